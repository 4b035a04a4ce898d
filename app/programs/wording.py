"""What is said about the lines of a program text: what was understood, what was passed over on purpose, what was not understood."""

from typing import Any

from app.characteristics.wording import choice, label
from app.core.parameters import BY_NAME, Kind
from app.core.programs.corrections import Form
from app.core.programs.lines import (
    MOST_CHARACTERS,
    Note,
    ProgramError,
    ProgramKind,
    Verdict,
    written,
)
from app.web.i18n import _


def verdict_word(verdict: str) -> str:
    return {
        Verdict.UNDERSTOOD: _("Understood"),
        Verdict.IGNORED: _("Passed over"),
        Verdict.NOT_UNDERSTOOD: _("Not understood"),
    }[Verdict(verdict)]


def kind_word(kind: str) -> str:
    return {
        ProgramKind.CALIBRATION: _("Calibration"),
        ProgramKind.MEASURING: _("Measuring program"),
        ProgramKind.ASSIGNMENTS: _("Assignments"),
        ProgramKind.RESULTS: _("Results"),
    }[ProgramKind(kind)]


def refused(error: ProgramError) -> str:
    """Why this is no program text."""
    return {
        "binary": _("is not text: it holds control characters, as a program in a binary format does"),
        "too_long": _("has more than {most} characters; send the measuring program alone, not the whole part program"),
        "too_many_lines": _("has more than {most} lines; send the measuring program alone, not the whole part program"),
        "empty": _("is empty; paste the program, or a line such as R33=0.001"),
    }[error.code].format(most=error.data.get("most", MOST_CHARACTERS))


def note(said: Note) -> str:
    """One note in words; what a program can do about it is left to the people who read it."""
    values = {name: value for name, value in said.data.items() if isinstance(value, str | int)}
    if said.code in {"assigned", "setting", "result", "assumed"}:
        return _taken(said)
    if said.code == "macro":
        return _("The macros of the lathe line say: {values}").format(values=_set(said.data["parameters"]))
    if said.code == "again":
        return _("{r} was assigned in line {line} already ({before}); the last one counts").format(
            **values | {"before": _value(None, said.data["before"])}
        )
    return {
        "call": _call(str(values.get("word", ""))),
        "r44_for_r34": _("R44 is taken for R34, as the manual misprints it; check that it is the averaging limit"),
        "skip_block": _("The block begins with /: on the control it is left out while block skip is on"),
        "not_used": _("{r} is not used here"),
        "no_tool": _("No tool is named (R10): as it stands it measures only, and nothing is corrected"),
        "l75_missing": _("L75 is not called; target and tolerance are computed from R40, R41 and R42 all the same"),
        "l75_wins": _("{r} is computed anew by L75, so this value does not count"),
        "two_point": _("{r} does not count, because R24 asks for two points"),
        "comment": _("comment"),
        "empty": _("empty line"),
        "words": _("{words}: no parameters"),
        "computed": _("{text}: computed by the macro itself"),
        "expression": _("{r}: {text} is a calculation; write the number that it comes to"),
        "no_value": _("{r} has no value"),
        "placeholder": _("{r}: {text} stands for a number; write the number"),
        "unknown_r": _("{r} is no parameter of the measuring cycles"),
        "unknown": _("{text} is not known"),
        "too_large": _("{r} has a number too large for any control"),
        "too_long": _("The line has {got} characters; no control takes more than {most}"),
        "bad_setting": _("{text}: there is no such setting, or it cannot have this value"),
    }[said.code].format(**values)


def _call(word: str) -> str:
    words = {
        "L05": _("calibration subprogram"),
        "L15": _("measuring subprogram"),
        "L75": _("target and tolerance from the drawing"),
        "L92": _("calibration cycle"),
        "L93": _("measuring cycle"),
    }
    return f"{word}: {words[word]}" if word in words else _("calls {word}").format(word=word)


def _taken(said: Note) -> str:
    data = said.data
    name = data.get("name")
    value = _value(name, data["value"])
    if said.code == "result":
        return _("result {r} = {value} {name}").format(r=data["r"], value=value, name=variable(data["r"]))
    if said.code == "assumed":
        field = BY_NAME[data["name"]]
        return _("{r} {name} is not in the text: {value} is taken, the least of the cycles' range").format(
            r=field.r, name=label(field.name).lower(), value=value
        )
    if said.code == "setting":
        return _("{name}: {value}").format(name=_named(data["name"]), value=value)
    words = {"r": data["r"], "value": value, "name": variable(data["r"]) or (_named(name) if name else "")}
    if data["how"] == "run_together":
        return _("{r} = {value} {name}, written without =").format(**words)
    if data["how"] == "name":
        return _("{text} is {r} = {value} {name}").format(**words, text=data["text"])
    return _("{r} = {value} {name}").format(**words).rstrip()


def variable(r: str) -> str:
    """What a number means that is no parameter here: of the calibration, of the macros, of what a cycle has found."""
    return {
        "R21": _("surface"),
        "R22": _("probe"),
        "R24": _("two points"),
        "R42": _("nominal"),
        "R43": _("measured"),
        "R44": _("difference"),
        "R46": _("memory location"),
        "R47": _("tool offset number"),
        "R49": _("average"),
        "#500": _("start X"),
        "#501": _("start Z"),
        "#502": _("probe radius term"),
        "#503": _("radius"),
        "#504": _("probing feed"),
        "#510": _("section 1"),
        "#511": _("section 2"),
        "#512": _("section 3"),
        "#513": _("rejects"),
    }.get(r, "")


def _named(name: str) -> str:
    words = {"characteristic": _("key"), "name": _("name"), "part": _("part")}
    return words.get(name) or label(name).lower()


def _value(name: str | None, value: Any) -> str:
    if isinstance(value, dict):
        return _("{n} of {m}").format(n=value["n"], m=value["m"])
    if isinstance(value, bool):
        return _("yes") if value else _("no")
    if isinstance(value, int | float):
        field = BY_NAME.get(name or "")
        return written(value) + (" mm" if field is not None and field.kind is Kind.LENGTH else "")
    return choice(name or "", str(value)).lower()


def _set(parameters: dict[str, Any]) -> str:
    return ", ".join(f"{_named(name)} = {_value(name, value)}" for name, value in parameters.items())


def form_word(form: str) -> str:
    """What a form of correction text is called where one chooses it."""
    return {
        Form.TURNING: _("$TC_DP, turning: X is length 1, Z is length 2"),
        Form.MILLING: _("$TC_DP, milling: X and Y are the radius, Z is length 1"),
        Form.WEAR_VARIABLES: _("Wear variables #[2700+n] of the lathe line"),
        Form.WEAR_VARIABLES_2000: _("Wear variables #[2000+n], Fanuc lathe"),
        Form.G10: _("G10 with U and W, incremental"),
        Form.G10_ABSOLUTE: _("G10 with X and Z, absolute, without user macros"),
        Form.LIST: _("A list to type in"),
    }[Form(form)]


def guarded(form: str) -> str:
    """What happens when the text is run twice."""
    if form == Form.LIST:
        return _("Nothing guards what is typed in by hand: confirm it here as soon as it is done.")
    if form == Form.G10_ABSOLUTE:
        return _(
            "Each block sets the offset to its value, so running it twice changes nothing. It does not look first."
        )
    if form == Form.G10:
        return _("#598 and #599 remember the corrections that are in, so running it twice changes nothing.")
    names = "R98, R99" if form in {Form.TURNING, Form.MILLING} else "#598, #599"
    return _(
        "Running it twice changes nothing: {names} remember the corrections that are in, and every offset is looked at "
        "before it is set. If one is not as expected, the text stops and changes nothing more."
    ).format(names=names)
