"""Sentences about the lines of a program text: understood, ignored on purpose, not understood."""

import re
from typing import Any

from app.core.parameters import BY_NAME, FieldKind
from app.core.programs.correction_forms import Form
from app.core.programs.heidenhain import ANGLE, PARAMETERS
from app.core.programs.lines import MOST_CHARACTERS, LineVerdict, Note, ProgramError, ProgramKind, written
from app.language.i18n import _
from app.loop.characteristics.wording import choice, label


def verdict_word(verdict: str) -> str:
    return {
        LineVerdict.UNDERSTOOD: _("Understood"),
        LineVerdict.IGNORED: _("Passed over"),
        LineVerdict.NOT_UNDERSTOOD: _("Not understood"),
    }[LineVerdict(verdict)]


def kind_word(kind: str) -> str:
    return {
        ProgramKind.CALIBRATION: _("Calibration"),
        ProgramKind.MEASURING: _("Measuring program"),
        ProgramKind.ASSIGNMENTS: _("Assignments"),
        ProgramKind.RESULTS: _("Results"),
        ProgramKind.KINEMATICS: _("Kinematics cycle"),
        ProgramKind.WORK_ZERO: _("Work zero by an edge finder"),
    }[ProgramKind(kind)]


def refused(error: ProgramError) -> str:
    """The reason why this is not a program text."""
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
    if said.code == "step":
        return _step(said.data)
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
        "not_used": _("Inband does not use {r}"),
        "feeler_range": _("The feeler (#2) is {value} mm: the macro raises an alarm outside 0 to {highest} mm"),
        "no_tool": _("No tool is named (R10): as it is it only measures, and nothing is corrected"),
        "l75_missing": _("L75 is not called; target and tolerance are computed from R40, R41 and R42 all the same"),
        "l75_wins": _("{r} is computed again by L75, so this value does not count"),
        "two_point": _("{r} does not count, because R24 asks for two points"),
        "comment": _("comment"),
        "remark": _("{text}: read as a remark. Put it behind ; or in brackets, else the control stops at it"),
        "empty": _("empty line"),
        "words": _("{words}: no parameters"),
        "computed": _("{text}: computed by the macro itself"),
        "expression": _("{r}: {text} is a calculation; write the number that it comes to"),
        "no_value": _("{r} has no value"),
        "cycle": _cycle(values.get("cycle", 0)),
        "q_assigned": _("{r} = {shown} {name}"),
        "q_range": _("{r} {shown} is outside what the cycle takes: {lowest} to {highest}"),
        "q_missing": _("The call does not say {names}"),
        "unknown_q": _("{r} is no parameter of cycle {cycle}"),
        "tcpm_active": _("M128 or FUNCTION TCPM is on since line {line}; the cycle wants it off"),
        "tilted": _("The plane is tilted since line {line}; reset it before the cycle"),
        "rotated": _("A rotation is active since line {line}; switch the basic rotation off before the cycle"),
        "cut_out": _("{r}: {name} cut out of {source}"),
        "as_number": _("{r} = {name} as a number"),
        "cut_wrong": _("{source}: ten characters from 0, 11, 22 or 33 are one number, not {length} from {begin}"),
        "blank_in_number": _("{r}: {text} has a blank inside and is not a number; the parameter is left out"),
        "no_number": _("{r}: {text} is not a number; the parameter is left out"),
        "unit_inch": _("{word}: lengths are in inches from here on, and become mm"),
        "unit_mm": _("{word}: lengths are in mm"),
        "unit_mixed": _(
            "{r} is left out: the unit changes in this program, and it cannot be determined whether it is inch or mm. Say one unit "
            "before the first length"
        ),
        "from_inch": _("The lengths were in inches; here they are mm"),
        "printed_minus": _("There is a printed minus sign (−) in the line; it is read as -, but no control takes it"),
        "placeholder": _("{r}: {text} is used as a number; write the number"),
        "unknown_r": _("{r} is no parameter of the measuring cycles"),
        "unknown": _("{text} is not known"),
        "too_large": _("{r} has a number too large for any control"),
        "too_long": _("The line has {got} characters; no control takes more than {most}"),
        "bad_setting": _("{text}: there is no such setting, or it cannot have this value"),
    }[said.code].format(**values | _of_q(said))


def _step(data: dict[str, Any]) -> str:
    """One step of a printed macro."""
    values = {name: f"{value:g}" if isinstance(value, float) else value for name, value in data.items()}
    sentence = {
        "touch": _("{r}: where the machine stands in {axis} at the touch"),
        "touch_any": _("where the machine stands in {axis} at the touch, into the variable that {r} counts"),
        "centre": _("{r}: the middle between two points"),
        "old_kept": _("{r}: the old {axis} of {offset} is kept"),
        "offset_set": _("{axis} of {offset} is set to {r}"),
        "offset_chosen": _("{r}: G{value}, the work offset that the macro sets"),
        "feeler": _("{r}: thickness of the feeler, {value} mm"),
        "z_zero": _("{r}: Z zero, less the feeler and the length of the tool"),
        "limit_size": _("{r}: a limit of the size, from nominal and deviation"),
        "measured": _("{r}: measured size, the position with #502 added"),
        "not_a_bore": _("first move along Z: if it triggers it is no bore, on to N{label}"),
        "compared": _("compared, and gone on elsewhere"),
        "corrected": _("the tool offset is corrected by the macro itself"),
        "modal_kept": _("{r}: a modal state is kept"),
        "modal_restored": _("the modal state from {r} is restored"),
        "alarm": _("raises an alarm on the control"),
        "message": _("message on the control"),
        "jump": _("goes on elsewhere"),
    }
    step = str(data["step"])
    if step == "size":
        side = _("inside, the tip {tip} is added") if data["sign"] == "+" else _("outside, the tip {tip} is taken off")
        return _("{r}: the size; {side}").format(side=side, r=data["r"]).replace("{tip}", f"{data['tip']:g} mm")
    if step == "probing_target":
        if "value" in data:
            return _("probing target ±(nominal + radius × cos 12.5° − 1 mm) = {value} mm").format(
                value=written(data["value"])
            )
        return _("probing target: nominal + radius × cos 12.5° − 1 mm")
    return sentence[step].format(**values)


def _cycle(cycle: Any) -> str:
    names = {
        450: _("saves or restores the kinematics"),
        451: _("measures the kinematics"),
        452: _("preset compensation"),
    }
    return f"TCH PROBE {cycle}: {names.get(cycle, '')}"


def q_name(q: str) -> str:
    """Name of a Q parameter of the kinematics cycles."""
    axis = re.fullmatch(r"Q4(1[1-9]|2[0-2])", q)
    if axis:
        at = int(axis[1]) - 11
        words = (_("start angle"), _("end angle"), _("incidence angle"), _("measuring points"))
        return _("{what}, axis {axis}").format(what=words[at % 4], axis="ABC"[at // 4])
    return {
        "Q406": _("mode"),
        "Q407": _("radius of the sphere"),
        "Q320": _("set-up clearance"),
        "Q408": _("retract height"),
        "Q253": _("feed of pre-positioning"),
        "Q380": _("reference angle"),
        "Q423": _("probed points of the sphere"),
        "Q431": _("preset"),
        "Q432": _("backlash angle"),
        "Q410": _("mode"),
        "Q409": _("memory"),
        "cycle": _("cycle"),
    }.get(q, "")


def q_value(q: str, value: Any) -> str:
    """A Q parameter's value with its unit."""
    if isinstance(value, str):
        return value
    number = written(float(value))
    if q in {"Q407", "Q320", "Q408"}:
        return f"{number} mm"
    if q == "Q253":
        return f"{number} mm/min"
    known = PARAMETERS.get(q)
    return (
        f"{number}°"
        if known is not None and known.highest in {360, ANGLE[1], 3} and q not in {"Q406", "Q431"}
        else number
    )


def _of_q(said: Note) -> dict[str, str]:
    if said.code not in {"q_assigned", "q_range"}:
        return {}
    q = said.data["r"]
    value = q_value(q, said.data["value"])
    if "inch" in said.data:
        value = _("{inch} inch = {value}").format(inch=written(said.data["inch"]), value=value)
    limits: dict[str, str] = {name: f"{said.data[name]:g}" for name in ("lowest", "highest") if name in said.data}
    return {"shown": value, "name": q_name(q), **limits}


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
    if "inch" in data:
        value = _("{inch} inch = {value} mm").format(inch=written(data["inch"]), value=value.removesuffix(" mm"))
    if said.code == "result":
        return _("result {r} = {value} {name}").format(r=data["r"], value=value, name=variable(data["r"]))
    if said.code == "assumed":
        field = BY_NAME[data["name"]]
        return _("{r} {name} is not in the text: {value} is taken, the least of the cycles' range").format(
            r=field.r, name=label(field.name).lower(), value=value
        )
    if said.code == "setting":
        return _("{name}: {value}").format(name=_named(data["name"]), value=value)
    words = {"r": data["r"], "value": value, "name": _meaning(data["r"], name)}
    if data["how"] == "run_together":
        return _("{r} = {value} {name}, written without =").format(**words)
    if data["how"] == "name":
        return _("{text} is {r} = {value} {name}").format(**words, text=data["text"])
    return _("{r} = {value} {name}").format(**words).rstrip()


def _meaning(r: str, name: str | None) -> str:
    known = BY_NAME.get(name or "")
    return label(known.name).lower() if known is not None else variable(r) or (_named(name) if name else "")


def variable(r: str) -> str:
    """Meaning of a number that is no parameter here: of the calibration, of the macros, of a cycle's results."""
    return {
        "R21": _("surface"),
        "R22": _("probe"),
        "R23": _("surface, 0 free"),
        "R24": _("two-point measurement, 0 off"),
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
        return written(value) + (" mm" if field is not None and field.kind is FieldKind.LENGTH else "")
    return choice(name or "", str(value)).lower()


def _set(parameters: dict[str, Any]) -> str:
    return ", ".join(f"{_named(name)} = {_value(name, value)}" for name, value in parameters.items())


def form_word(form: str) -> str:
    """Name of a form of correction text, for the choice of it."""
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
    """The protection of the text against being run twice."""
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
