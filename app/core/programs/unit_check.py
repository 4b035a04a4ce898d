"""Lines that stop a text on a control that works in inch: Inband writes all lengths in mm.

Where the control can be asked, it is asked for the unit in force:

- Sinumerik: G group 13, ``$P_GG[13]``, 1 for G70 and 2 for G71 (Vericut's description of the 840D); and
  ``$MN_SCALING_SYSTEM_IS_METRIC`` (MD 10240), because G70 and G71 do not touch tool offsets and settable work offsets, which
  are in the basic system (Siemens, 802D sl programming 6FC5398-3CP10, 8.2.3; basic functions 6FC5397-0BP40, 7.3).
- Fanuc: ``#4006``, for the number of a modal group is added to 4000, and group 06 holds G20 and G21 (M. Lynch, Modern Machine
  Shop, "Taking advantage of G code grouping").
- Heidenhain: ``Q113``, 1 where the highest program of a nesting is in inch (user's manual, preassigned Q parameters).

Two numbers rest on the manuals' order alone, no public source that could be read states them: 3 for G700 on a Sinumerik, and
70 for G70 of lathes with Fanuc's G code system C. They are to be tried on the control first (docs/how-to/program-text.md).

The older Sinumerik of L92 and L93, ``G10`` without user macros, and lists cannot be asked: a comment says the unit.
"""

from collections.abc import Iterator

FANUC_ALARM, LATHE_LINE_ALARM = "#3000=1({})", "G65 H99 P0(/{})"


def sinumerik() -> Iterator[str]:
    """Yield the check of a Sinumerik with system variables: `M0` in a loop that only a reset ends."""
    yield "; LENGTHS ARE MM: IT STOPS WHERE THE CONTROL WORKS IN INCH."
    yield "INBAND_UNIT:"
    yield "IF ($MN_SCALING_SYSTEM_IS_METRIC==1) AND ($P_GG[13]<>1) AND ($P_GG[13]<>3) GOTOF INBAND_MM"
    yield 'MSG("INBAND: THE CONTROL WORKS IN INCH. NOTHING WAS CHANGED")'
    yield "M0"
    yield "STOPRE"
    yield "GOTOB INBAND_UNIT"
    yield "INBAND_MM:"


def fanuc(alarm: str = FANUC_ALARM) -> Iterator[str]:
    """Yield the check of a Fanuc with user macros. alarm: how this control raises one."""
    yield "(LENGTHS ARE MM: IT STOPS WHERE THE CONTROL WORKS IN INCH)"
    yield "IF[#4006EQ20]GOTO8020"
    yield "IF[#4006NE70]GOTO8021"
    yield f"N8020 {alarm.format('INBAND: CONTROL IS IN INCH')}"
    yield "M99"
    yield "N8021"


def heidenhain() -> Iterator[str]:
    """Yield the check of a Heidenhain: a loop of `STOP`."""
    yield "; LENGTHS ARE MM: IT STOPS WHERE THE MAIN PROGRAM IS IN INCH."
    yield "; A PROGRAM THAT CALLS OR HOLDS THIS TEXT BEGINS WITH BEGIN PGM ... MM"
    yield 'FN 9: IF +Q113 EQU +0 GOTO LBL "INBAND MM"'
    yield 'LBL "INBAND INCH"'
    yield "STOP ; INBAND: THE PROGRAM IS IN INCH"
    yield 'FN 9: IF +0 EQU +0 GOTO LBL "INBAND INCH"'
    yield 'LBL "INBAND MM"'


def said(code: str) -> str:
    """Return what a text says that cannot ask. code: the G code that makes the control metric."""
    return f"LENGTHS ARE MM: RUN IT WITH {code} ACTIVE"
