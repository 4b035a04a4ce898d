"""User macros for Fanuc and its like that print each reading by DPRNT, and the last eight again at the end of a program.

The line is that of `app.core.printed_line`. Three programs: one stores a reading and prints it, one prints the last eight again,
one prints a line. Numbers are calculated with eight digits, so every term of the check sum is reduced by itself.
"""

from typing import Final

from app.core.printed_line import END, MODULUS, START, WEIGHTS
from app.core.ring import HIGHEST_SEQUENCE, SLOTS

SIZE: Final = 8
"""Variables of a stored reading: sequence, characteristic, size, correction in effect, part, tool, status, time."""
FIRST_STORED: Final = 10
REGISTERS: Final = FIRST_STORED + SLOTS * SIZE
"""Variables that are used: 0 epoch, 1 last sequence, from 10 on the last eight readings."""
LOWEST: Final = 500
HIGHEST: Final = 999
"""Variables that outlast the power."""
OF_TEXTS: Final = range(598, 604)
"""Variables of the texts of corrections and work offsets."""
_LOCALS: Final = {"E": 12, "N": 4, "C": 5, "I": 7, "P": 8, "T": 9, "S": 10, "U": 13}


def dprnt_programs(first_register: int = 700, first_program: int = 9825) -> str:
    """The three programs as one text.

    Raises `ValueError` where the variables do not outlast the power or belong to other texts, or the number is none of a program.
    """
    if not LOWEST <= first_register <= HIGHEST - REGISTERS + 1:
        raise ValueError(f"The first variable is {LOWEST} to {HIGHEST - REGISTERS + 1}, not {first_register}.")
    if first_register < OF_TEXTS.stop and first_register + REGISTERS > OF_TEXTS.start:
        raise ValueError(
            f"{REGISTERS} variables from {first_register} on must leave {OF_TEXTS.start} to {OF_TEXTS.stop - 1} free: "
            "the texts of corrections and work offsets use them."
        )
    if not 1 <= first_program <= 9997:
        raise ValueError(f"The first program is 1 to 9997, not {first_program}.")
    reading, again, line = (f"{first_program + at:04}" for at in range(3))
    return "\n".join(
        [
            "%",
            *_reading(first_register, reading, line),
            *_again(first_register, again, line),
            *_line(line),
            "%",
            "",
        ]
    )


def _place(sequence: str) -> str:
    return f"#33+{FIRST_STORED}+{SIZE}*[{sequence}-1-FIX[[{sequence}-1]/{SLOTS}]*{SLOTS}]"


def _reading(first: int, number: str, line: str) -> list[str]:
    return [
        f"O{number} (INBAND PRINT A READING)",
        f"(G65 P{number} C1. V#135 T3. W#3901 - BEHIND THE MEASURING)",
        "(C CHARACTERISTIC, V SIZE, T TOOL, W PART, E NUMBER OF THE CORRECTION IN EFFECT)",
        "(S 1 IF THE PROBE DID NOT TRIGGER, 2 IF ON ITS FIRST MOVE, 3 MARKED)",
        f"#33={first} (FIRST OF {REGISTERS} VARIABLES)",
        "IF [#22 EQ #0] GOTO 90",
        "IF [ABS[#22] GE 9999] GOTO 90",
        "IF [#3 LT 0.5] GOTO 90",
        "#3=#3+0",
        "#8=#8+0 (LEFT OUT IS 0)",
        "#19=#19+0",
        "#20=#20+0",
        "#23=#23+0",
        "(TIME - SECONDS OF THE DAY)",
        "#24=FIX[#3012/10000]",
        "#25=#3012-#24*10000",
        "#26=FIX[#25/100]",
        "#24=3600*#24+60*#26+#25-100*#26",
        "IF [#[#33] GT 0.5] GOTO 10",
        "(A NEW EPOCH - THE VARIABLES WERE EMPTY)",
        "#25=#3011-FIX[#3011/100]*100",
        "#25=#25-FIX[#25/11]*11",
        "#26=#3001-FIX[#3001/1000]*1000",
        "#[#33+1]=0",
        "#[#33]=1+86400*#25+#24+49*FIX[#26]",
        "N10 #32=#[#33+1]+1",
        f"IF [#32 GT {HIGHEST_SEQUENCE}] GOTO 91",
        f"#31={_place('#32')}",
        "#[#31]=0 (THE STORED ONE DOES NOT COUNT WHILE IT IS WRITTEN)",
        *(f"#[#31+{at}]=#{given}" for at, given in enumerate((3, 22, 8, 23, 20, 19, 24), start=1)),
        "#[#31]=#32",
        "#[#33+1]=#32",
        f"G65 P{line} A#31 B#[#33]",
        "M99",
        "N90 #3000=94(INBAND WRONG ARGUMENT)",
        "N91 #3000=95(INBAND NEEDS A NEW EPOCH)",
    ]


def _again(first: int, number: str, line: str) -> list[str]:
    return [
        f"O{number} (INBAND PRINT THE LAST {SLOTS} AGAIN)",
        f"(G65 P{number} - AT THE END OF THE PROGRAM. WHAT GOT LOST ON THE LINE COMES AGAIN)",
        f"#33={first}",
        f"#32=#[#33+1]-{SLOTS - 1}",
        "N10 IF [#32 LT 0.5] GOTO 20",
        f"#31={_place('#32')}",
        "IF [ABS[#[#31]-#32] GT 0.5] GOTO 20",
        f"G65 P{line} A#31 B#[#33]",
        "N20 #32=#32+1",
        "IF [#32 LE #[#33+1]] GOTO 10",
        "M99",
    ]


def _line(number: str) -> list[str]:
    """Print the reading that is stored from #1 on, of epoch #2."""

    def reduced(name: int) -> str:
        return f"#{name}-FIX[#{name}/{MODULUS}]*{MODULUS}"

    def printed(decimals: int) -> str:
        size = f"V#6[{8 - decimals}{decimals}]"
        return f"DPRNT[{START}*E#12[60]*N#4[70]*C#5[40]*{size}*I#7[70]*P#8[70]*T#9[40]*S#10[10]*H#11[50]*U#13[10]*K#14[20]*{END}]"

    return [
        f"O{number} (INBAND PRINT ONE LINE)",
        "(A FIRST VARIABLE OF THE STORED READING, B EPOCH)",
        "#12=#2",
        *(f"#{own}=#[#1{f'+{at}' if at else ''}]" for at, own in enumerate(range(4, 12))),
        "#13=1 (UNIT 1 MM, 2 INCH)",
        "#15=10000",
        "IF [ABS[#4006-20] GT 0.5] GOTO 10",
        "#13=2",
        "#15=100000",
        "N10 #16=ROUND[#6*#15] (THE SIZE AS IT IS PRINTED)",
        "#6=#16/#15",
        "(CHECK SUM)",
        "#14=0",
        "IF [#16 GE 0] GOTO 20",
        "#14=1",
        "#16=0-#16",
        f"N20 #14=#14+{reduced(16)}",
        "#16=#11+1",
        f"#14=#14+{WEIGHTS['H']}*[{reduced(16)}]",
        *(f"#14=#14+{WEIGHTS[letter]}*[{reduced(own)}]" for letter, own in _LOCALS.items()),
        f"#14={reduced(14)}",
        "POPEN",
        "IF [#13 GT 1.5] GOTO 30",
        printed(4),
        "GOTO 40",
        f"N30 {printed(5)}",
        "N40 PCLOS",
        "M99",
    ]
