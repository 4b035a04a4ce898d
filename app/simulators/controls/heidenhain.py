"""A simulated TNC behind LSV2: file transfer, and an NC program that appends lines by FN 16 and calls the correction program.

It speaks as far as pyLSV2 listens: logins, versions, parameters, files. Traps: the lines have a decimal comma; a block that is run
again prints its lines again; text has a zero where a line ends; a file that is being sent is not there before its end.
"""

import asyncio
import re
import struct

from app.bridge.kinds.heidenhain import Answered, answer_check
from app.core.printed_line import Printed, line_of
from app.core.ring import Mail, Register, Slot, Told, Unit, mail_registers
from app.simulators.controls.model import Feature, Model
from app.simulators.controls.tcp_control import TcpControl

FEATURES = (Feature(tool=3, register="QR31", parameter=31, holds="radius"),)
READINGS, CORRECTIONS = "TNC:\\inband\\readings.txt", "TNC:\\inband\\corr.h"
FOLDER = "TNC:\\inband"
TICK = 0.01  # s
BLOCK = 500  # bytes of a file in a telegram
NO_FILE, EXISTS, NO_LOGIN, NO_DIRECTORY = 32, 34, 49, 55


class Refused(Exception):
    """A telegram that is answered by T_ER and a number."""

    def __init__(self, code: int) -> None:
        super().__init__(code)
        self.code = code


class Session:
    """One connection: its logins, its directory, and the file that is on its way."""

    def __init__(self, tnc: "TncSimulator") -> None:
        self.tnc = tnc
        self.logins: set[str] = set()
        self.directory = "TNC:"
        self.to_send: list[bytes] = []
        self.taking: tuple[str, bytearray] | None = None

    def answer(self, command: str, payload: bytes) -> tuple[str, bytes]:
        """The answer to a telegram. Raises `Refused`."""
        words = [word.decode("cp1252") for word in payload.split(b"\0")]
        if command == "A_LG":
            if words[0] not in self.tnc.allowed:
                raise Refused(NO_LOGIN)
            self.logins.add(words[0])
            return "T_OK", b""
        if command in {"A_LO", "C_CC"}:
            return "T_OK", b""
        if command == "R_VR":
            return "S_VR", self._version(payload)
        if command == "R_PR":
            numbers = [0] * 42
            numbers[32] = 1024  # longest telegram
            numbers[30] = 1
            return "S_PR", struct.pack("!14L8B8L2BH4B2L2HL", *numbers)
        if command == "R_CI":
            return "S_CI", struct.pack("!LL", 1 if payload[-1] != 3 else 2, 0)
        if "FILE" not in self.logins:
            raise Refused(NO_LOGIN)
        return self._file(command, words, payload)

    def _version(self, payload: bytes) -> bytes:
        if not payload:
            return b"TNC640\x00340590 07\x00PLC-1\x00%11111111\x00"
        return {5: self.tnc.model.serial.encode(), 6: b"release"}.get(payload[0], b"none") + b"\0"

    def _file(self, command: str, words: list[str], payload: bytes) -> tuple[str, bytes]:
        files = self.tnc.files
        name = words[0]
        if command == "C_DC":
            if name.rstrip("\\") != FOLDER:
                raise Refused(NO_DIRECTORY)
            self.directory = name.rstrip("\\")
        elif command == "R_DI":
            return "S_DI", bytes(164) + self.directory.encode() + b"\0"
        elif command == "R_FI":
            size = len(self._held(name))
            return "S_FI", struct.pack("!LLL", size, 1_700_000_000 + size, 2) + name.encode() + b"\0"
        elif command == "R_FL":
            text = self._held(name).replace(b"\r\n", b"\0")
            self.to_send = [text[at : at + BLOCK] for at in range(0, len(text), BLOCK)]
            return self._next()
        elif command == "T_OK":
            return self._next()
        elif command == "C_FL":
            self.taking = (name, bytearray())
        elif command == "S_FL" and self.taking:
            self.taking[1].extend(payload)
        elif command == "T_FD" and self.taking:
            files[self.taking[0]] = bytes(self.taking[1])
            self.taking = None
        elif command == "C_FD":
            self._held(name)
            del files[name]
        elif command == "C_FR":
            source = f"{self.directory}\\{name}"
            if words[1] in files:
                raise Refused(EXISTS)
            files[words[1]] = self._held(source)
            del files[source]
        else:
            raise Refused(50)
        return "T_OK", b""

    def _held(self, name: str) -> bytes:
        if name not in self.tnc.files:
            raise Refused(NO_FILE)
        return self.tnc.files[name]

    def _next(self) -> tuple[str, bytes]:
        return ("S_FL", self.to_send.pop(0)) if self.to_send else ("T_FD", b"")


class TncSimulator(TcpControl):
    """A control that is running. files: by name. allowed: logins. silent: it takes telegrams and answers none."""

    def __init__(self, model: Model) -> None:
        super().__init__(model)
        self.files: dict[str, bytes] = {READINGS: b""}
        self.allowed = {"INSPECT", "FILE"}
        self.silent = False
        self._printed = 0
        self._answered: set[int] = set()
        self._last = b""
        self._stopped = ""

    def table(self) -> dict[str, object]:
        """The table of a machine in the configuration."""
        return self.model.table(
            "heidenhain",
            {"address": "127.0.0.1", "port": self.port},
            identity=f"TNC640 {self.model.serial}",
            proof_needed=False,
            location=self.model.locations,
        )

    async def _talk(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        session = Session(self)
        while True:
            head = await reader.readexactly(8)
            payload = await reader.readexactly(struct.unpack("!L", head[:4])[0])
            if self.silent:
                continue
            try:
                command, content = session.answer(head[4:].decode("ascii"), payload)
            except Refused as refused:
                command, content = "T_ER", bytes((1, refused.code))
            writer.write(struct.pack("!L", len(content)) + command.encode() + content)
            await writer.drain()

    # --- the NC program's side

    async def _work(self) -> None:
        registers = self.model.registers
        answered = registers[Register.ANSWERED]
        while True:
            for epoch, slot in self.model.written[self._printed :]:
                self._append(line_of(Printed(epoch, Unit(self.model.unit), _rounded(slot, self.model.unit))))
                self._printed += 1
            registers[Register.ACK] = registers[Register.WRITTEN]  # a file waits for nobody
            if registers[Register.ANSWERED] != answered:
                answered = registers[Register.ANSWERED]
                self._append(self._answer())
            self._mail()
            await asyncio.sleep(TICK)

    def _append(self, line: str) -> None:
        self._last = line.replace(".", ",").encode("cp1252") + b"\r\n"
        self.files[READINGS] = self.files.get(READINGS, b"") + self._last

    def run_again(self) -> None:
        """The last block is run again, and prints its line again."""
        self.files[READINGS] += self._last

    def _answer(self) -> str:
        registers = self.model.registers
        unit = Unit(self.model.unit)
        held = round(registers[Register.OFFSET], 4 if unit is Unit.MM else 5) + 0.0
        one = Answered(
            round(registers[Register.ANSWERED]),
            round(registers[Register.ANSWER]),
            round(registers[Register.MAIL_PARAMETER]),
            held,
            unit,
        )
        shown = f"{held:.{4 if unit is Unit.MM else 5}f}"
        check = answer_check(one)
        return f"INBANS N{one.number} A{one.answer} R{one.register} V{shown} U{int(unit)} K{check} FIN"

    def _mail(self) -> None:
        """The correction program as the model's mailbox: the program's statements are what the mailbox says."""
        registers = self.model.registers
        text = self.files.get(CORRECTIONS, b"").decode("cp1252")
        if not text.rstrip().endswith("END PGM CORR MM") and not text.rstrip().endswith("END PGM CORR INCH"):
            return
        if (stop := re.search(r" QR5 = \+(\d+)", text)) and stop[1] != self._stopped:
            self._stopped = stop[1]
            self.model.told.append(Told.STOP)
        self._answered.add(round(registers[Register.ANSWERED]))
        for part in re.split(r"; Correction \d+", text)[1:]:
            number = re.search(r"QR3 = \+(\d+)", part)
            expected = re.search(r"ABS \( QR(\d+) - ([+-][\d.]+) \)", part)
            value = re.search(r"\bQR\d\d+ = ([+-][\d.]+)", part)
            if number and expected and value and int(number[1]) not in self._answered:
                break
        else:
            registers[Register.MAIL_NUMBER] = registers[Register.ANSWERED]
            return
        parameter = int(expected[1])
        feature = next((each for each in self.model.every if each.parameter == parameter), None)
        tool, edge = (feature.tool, feature.edge) if feature else (0, 0)
        mail = Mail(int(number[1]), tool, edge, parameter, float(expected[2]), float(value[1]))
        if registers[Register.MAIL_NUMBER] != mail.number:
            for place, content in mail_registers(mail, Unit(self.model.unit)):
                registers[place] = content


def _rounded(slot: Slot, unit: int) -> Slot:
    size = round(slot.measured, 4 if unit == Unit.MM else 5)
    return Slot(slot.sequence, slot.characteristic, size, slot.in_effect, slot.part, slot.tool, slot.status, slot.time)


async def serve(model: Model, port: int = 0) -> TncSimulator:
    """Start a simulated control."""
    simulator = TncSimulator(model)
    await simulator.start(port)
    return simulator
