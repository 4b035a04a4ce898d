"""The program by which a Heidenhain TNC takes corrections, and stops."""

from collections.abc import Mapping, Sequence
from pathlib import PureWindowsPath

from app.bridge.configuration import Location
from app.bridge.links import Order

TOLERANCE = 0.0006  # mm: of the comparison that the TNC makes


def correction_program(
    orders: Sequence[Order], locations: Mapping[int, Location], unit: str, name: str, stop: int | None = None
) -> str:
    """The program that sets each offset once, if the expected one is there, and answers; without orders it does nothing.

    locations: by tool memory. stop: the sequence of a reading behind which the machine has to stop, once.
    """
    lines = ["; Inband rewrites this program. Do not edit it."]
    if stop is not None:
        lines += [
            f"FN 9: IF +QR5 EQU +{stop} GOTO LBL 8 ; stopped before",
            f"QR5 = +{stop}",
            "STOP ; Inband says stop: look at its alarm",
            "LBL 8",
        ]
    ordered = sorted(orders, key=lambda order: order.number)  # QR3 ends with the highest number
    if ordered:
        lines.append(f"FN 9: IF +QR4 EQU +{ordered[-1].number} GOTO LBL 9 ; answered before")
        for at, order in enumerate(ordered, start=1):
            lines += _set_once(order, locations[order.tool_memory], unit, 10 * at)
        lines += [f"QR4 = +{ordered[-1].number}", "LBL 9"]
    inside = PureWindowsPath(name).stem.upper()
    measure = "MM" if unit == "mm" else "INCH"
    lines = [f"BEGIN PGM {inside} {measure}", *lines, f"END PGM {inside} {measure}"]
    return "".join(f"{number} {line}\r\n" for number, line in enumerate(lines))


def _set_once(order: Order, location: Location, unit: str, label: int) -> list[str]:
    register = location.register
    before, after = (round(location.to_control(each, unit), 6) + 0.0 for each in (order.before, order.after))
    tolerance = TOLERANCE if unit == "mm" else TOLERANCE / 25.4
    expected, is_set, answer = (f"LBL {label + step}" for step in (1, 2, 3))
    return [
        f"; Correction {order.number}: tool {location.tool}",
        f"Q1610 = ABS ( {register} - {_signed(before)} )",
        f"FN 12: IF +Q1610 LT +{tolerance:.6f} GOTO {expected} ; as expected",
        f"Q1610 = ABS ( {register} - {_signed(after)} )",
        f"FN 12: IF +Q1610 LT +{tolerance:.6f} GOTO {is_set} ; set before, power was lost",
        "Q1611 = +1 ; another offset: it stays",
        f"FN 9: IF +0 EQU +0 GOTO {answer}",
        expected,
        f"{register} = {_signed(after)}",
        is_set,
        f"QR3 = +{order.number}",
        "Q1611 = +0",
        answer,
        f"Q1612 = +{order.number}",
        f"Q1613 = {register}",
        f"Q1614 = +{register[2:]}",
        "CALL PGM TNC:\\inband\\answer.h",
    ]


def _signed(value: float) -> str:
    return f"{value:+.6f}"
