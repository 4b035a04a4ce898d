"""Steps of printed measuring macros: the edge finder's (Sinumerik and Fanuc), and the bore on the lathe line.

Such a macro holds no parameters to judge by, but what its steps do can be said line by line: where it touches, what it takes
for the centre, which work offset it keeps and sets, how it moves the probe and when it raises an alarm. The lathe line's
probing target is ``#505+#503*COS[12.5]-1``; its control raises alarms by ``G65 H99 P0``.
"""

import re
from collections.abc import Iterable
from math import cos, radians
from typing import Any, NamedTuple

from app.core.programs.lines import NUMBER, Note, number_in

TARGET_ANGLE, TARGET_SHORTER = 12.5, 1.0  # degrees and mm of the printed probing target
AXES = "XYZ"


class _Step(NamedTuple):
    """A pattern, and the step that it is; names: what its groups say."""

    pattern: re.Pattern[str]
    step: str
    names: tuple[str, ...] = ()


def _p(text: str) -> re.Pattern[str]:
    return re.compile(text, re.IGNORECASE | re.ASCII)


_TARGET = r"#505\s*\+\s*#503\s*\*\s*COS\s*\[\s*12\.50*\s*\]\s*-\s*1\.?"
FANUC: tuple[_Step, ...] = (
    _Step(_p(r"G\s*65\s*H\s*99\s*P\s*(\d+)"), "alarm", ("number",)),
    _Step(_p(r"#3000\s*=\s*(\d+)"), "alarm", ("number",)),
    _Step(_p(r"#3006\s*=\s*(\d+)"), "message"),
    _Step(
        _p(rf"G\s*31\s*X\s*\[?\s*(-?)\s*\[\s*{_TARGET}\s*\]\s*\]?(?:\s*F\s*#?\d+\.?)?"),
        "probing_target",
        ("sign",),
    ),
    _Step(_p(rf"G\s*31\s*Z\s*(?:{NUMBER})(?:\s*F\s*\d+\.?)?\s*P\s*1\s*L\s*(\d+)"), "not_a_bore", ("label",)),
    _Step(_p(r"(#\d+)\s*=\s*#502([123])(?!\d)"), "touch", ("r", "axis")),
    _Step(_p(r"(#\d+)\s*=\s*#504([123])(?!\d)"), "touch", ("r", "axis")),
    _Step(_p(r"(#\d+)\s*=\s*\[\s*#(\d+)\s*\+\s*#(\d+)\s*\]\s*/\s*2(?![\d.])"), "centre", ("r", "a", "b")),
    _Step(_p(r"(#\d+)\s*=\s*#52(2|4|6|8)([123])(?!\d)"), "old_kept", ("r", "place", "axis")),
    _Step(_p(r"#52(2|4|6|8)([123])\s*=\s*(#\d+)"), "offset_set", ("place", "axis", "r")),
    _Step(_p(r"(#\d+)\s*=\s*#\d+\s*-\s*#2\s*-\s*#\[\s*(?:11000|2000)\s*\+\s*#4120\s*\]"), "z_zero", ("r",)),
    _Step(
        _p(r"(#\d+)\s*=\s*2\.?\s*\*\s*SQRT\s*\[.*?\]\s*\]?\s*([+-])\s*(\d+\.?\d*)(?=\s*$|\s+[#GNMO])"),
        "size",
        ("r", "sign", "tip"),
    ),
    _Step(_p(r"(#\d+)\s*=\s*ABS\s*\[\s*#\d+\s*-\s*#\d+\s*\]\s*([+-])\s*(\d+\.?\d*)"), "size", ("r", "sign", "tip")),
    _Step(_p(r"(#13[01])\s*=\s*#505\s*\+\s*#50([67])(?!\d)"), "limit_size", ("r", "which")),
    _Step(_p(r"(#51[012])\s*=\s*#\d+\s*\+\s*#502(?!\d)"), "measured", ("r",)),
    _Step(_p(r"#\[\s*(\d+)\s*\+\s*#\d+\s*\]\s*=.*"), "corrected", ("base",)),
    _Step(_p(r"#2732\s*=\s*#2732\s*[+-].*"), "corrected"),
    _Step(_p(r"(#\d+)\s*=\s*#4[01]\d\d(?!\d)"), "modal_kept", ("r",)),
    _Step(_p(r"[GTM]\s*\[\s*FUP\s*\[\s*(#\d+)\s*\]\s*\]"), "modal_restored", ("r",)),
    _Step(_p(r"IF\s*\[.*\]\s*GOTO\s*(\d+)"), "compared", ("label",)),
    _Step(_p(r"GOTO\s*(\d+)"), "jump", ("label",)),
)
SINUMERIK: tuple[_Step, ...] = (
    _Step(_p(r"R\s*\[\s*(R\d+)\s*\]\s*=\s*\$AA_IM\s*\[\s*([XYZ])\s*\]"), "touch_any", ("r", "axis")),
    _Step(_p(r"(R\d+)\s*=\s*\$AA_IM\s*\[\s*([XYZ])\s*\]"), "touch", ("r", "axis")),
    _Step(_p(r"(R\d+)\s*=\s*\(\s*R(\d+)\s*\+\s*R(\d+)\s*\)\s*/\s*2(?![\d.])"), "centre", ("r", "a", "b")),
    _Step(_p(r"(R\d+)\s*=\s*\$P_UIFR\s*\[\s*(\d+)\s*,\s*([XYZ])\s*,\s*TR\s*\]"), "old_kept", ("r", "frame", "axis")),
    _Step(_p(r"\$P_UIFR\s*\[\s*(\d+)\s*,\s*([XYZ])\s*,\s*TR\s*\]\s*=\s*(R\d+)"), "offset_set", ("frame", "axis", "r")),
    _Step(_p(r"(R\d+)\s*=\s*2\.?\s*\*\s*SQRT\s*\(.*?\)\s*\)\s*([+-])\s*(\d+\.?\d*)"), "size", ("r", "sign", "tip")),
    _Step(_p(r"(R\d+)\s*=\s*ABS\s*\(\s*R\d+\s*-\s*R\d+\s*\)\s*([+-])\s*(\d+\.?\d*)"), "size", ("r", "sign", "tip")),
    _Step(_p(r"(R20)\s*=\s*(?:R20(?:\s*\+\s*1)?|0|1)(?![\d.])"), "jump"),
    _Step(_p(r"MSG\s*\(.*\)"), "message"),
    _Step(_p(r"IF\s+.+?\s+GOTO[FB]?\s+(\w+)"), "compared", ("label",)),
    _Step(_p(r"CASE\s+.+"), "compared"),
    _Step(_p(r"GOTO[FB]?\s+(\w+)"), "jump", ("label",)),
    _Step(_p(r"^\s*[A-Z_]\w*:(?!\s*=)"), "jump"),
)


def target(nominal: float, radius: float) -> float:
    """The X to which the lathe line's probe moves: ``#505+#503*COS[12.5]-1``, mm.

    >>> round(target(40.0, 2.5), 6)
    41.44074
    """
    return nominal + radius * cos(radians(TARGET_ANGLE)) - TARGET_SHORTER


def steps(body: str, patterns: Iterable[_Step]) -> tuple[list[Note], str]:
    """The steps of a printed macro in a block, and what else is there.

    >>> steps("#501 =#5021 M00", FANUC)
    ([Note(code='step', data={'step': 'touch', 'r': '#501', 'axis': 'X'})], 'M00')
    """
    notes: list[Note] = []
    for pattern, step, names in patterns:

        def said(match: re.Match[str], step: str = step, names: tuple[str, ...] = names) -> str:
            notes.append(Note("step", {"step": step} | _named(dict(zip(names, match.groups(), strict=False)))))
            return " "

        body, found = pattern.subn(said, body)
        if found:
            body = " ".join(body.split())
    return notes, body.strip() if notes else body


def _named(said: dict[str, str | None]) -> dict[str, Any]:
    """The groups of a pattern in our words."""
    words: dict[str, Any] = {name: value.upper() for name, value in said.items() if value}
    if words.get("axis", "").isdigit():
        words["axis"] = AXES[int(words["axis"]) - 1]
    if "place" in words:  # 5221 is G54, 5241 G55 …
        words["offset"] = f"G{53 + int(words.pop('place')) // 2}"
    if "frame" in words:
        number = int(words.pop("frame"))
        words["offset"] = f"G{53 + number}" if number <= 4 else f"G{500 + number}"
    if "tip" in words:
        words["tip"] = number_in(words["tip"])
    return words


def work_zero(notes: Iterable[Note]) -> dict[str, Any]:
    """Settings of an edge finder's macro from its steps: the work offset, its axes, the tip's diameter.

    Empty where no work offset is set.
    """
    every = [note.data for note in notes if note.code == "step"]
    sets = [data for data in every if data["step"] == "offset_set"]
    if not sets:
        return {}
    settings: dict[str, Any] = {
        "work_offset": sets[0]["offset"],
        "axes": "".join(sorted({data["axis"] for data in sets})),
    }
    tips = {data["tip"] for data in every if data["step"] == "size" and data.get("tip")}
    if len(tips) == 1:
        settings["tip"] = tips.pop()
    saved = {data["axis"]: data["r"] for data in every if data["step"] == "old_kept"}
    return settings | ({"old_kept": ", ".join(f"{axis} {r}" for axis, r in sorted(saved.items()))} if saved else {})
