"""Alarm kinds about what corrections do to the size: the opposite, too much, too little, nothing, or what nobody can count."""

from datetime import datetime

from app.language.formatting import PLUS_MINUS, age, as_read, fixed, signed, um
from app.language.i18n import _
from app.loop.alarms.kinds import AlarmKind, register
from app.loop.alarms.reading_kinds import called, moved_by, uncorrected
from app.loop.tables.alarms import Alarm
from app.loop.tables.tools import DOUBT, EARLY, OPPOSITE, STILL_OUT, STRONG


def _opposed(alarm: Alarm) -> str:
    data = alarm.data
    return _(
        "Two corrections in a row moved {characteristic} the wrong way: {steps}. The gain is {gain} {pm} {error}, it should be "
        "1. Nothing is corrected through tool {tool} until this alarm is answered."
    ).format(
        characteristic=called(alarm),
        steps="; ".join(map(moved_by, data.get("corrections", ()))),
        gain=signed(data.get("gain"), 2),
        pm=PLUS_MINUS,
        error=fixed(data.get("error"), 2),
        tool=alarm.tool_memory,
    )


OPPOSITE_EFFECT = register(
    AlarmKind(
        OPPOSITE,
        concerns_parts=True,
        word=lambda: _("Opposite effect"),
        sentence=uncorrected(_opposed),
        what_to_do=lambda: _(
            "Check the sign of the factor of the characteristic, the sign and the offset register at the control, and which tool "
            "cuts it. Then answer the alarm: corrections before it no longer count."
        ),
        tone="stop",
        actions=("noted", "tool_replaced", "sister_tool"),
        comments={
            "noted": lambda: [
                _("Sign of the factor corrected"),
                _("Offset register corrected"),
                _("Another tool cuts it"),
                _("Edge chipped, replaced later"),
            ]
        },
    )
)


def _too_strong(alarm: Alarm) -> str:
    data = alarm.data
    return _(
        "The corrections of tool {tool} act too strongly: the gain is {gain} {pm} {error}, it should be 1. The size of {characteristic} "
        "swings from one side of the target to the other: {steps}. Of the newest {n} parts {out} are out of tolerance. Twice as "
        "strong: radius taken for diameter? Nothing is corrected through tool {tool} until this alarm is answered."
    ).format(
        tool=alarm.tool_memory,
        gain=signed(data.get("gain"), 2),
        pm=PLUS_MINUS,
        error=fixed(data.get("error"), 2),
        characteristic=called(alarm),
        steps="; ".join(map(moved_by, data.get("corrections", ()))),
        n=data.get("parts"),
        out=data.get("out"),
    )


STRONG_EFFECT = register(
    AlarmKind(
        STRONG,
        concerns_parts=True,
        word=lambda: _("Effect too strong"),
        sentence=uncorrected(_too_strong),
        what_to_do=lambda: _(
            "Check the factor of the characteristic and the offset at the control: is one of them a radius, the other a diameter? Check "
            "the offset register, which tool cuts it, and that nests or spindles in turn cut alike. Then answer the alarm: "
            "corrections before it no longer count."
        ),
        tone="stop",
        actions=("noted", "tool_replaced", "sister_tool"),
        comments={
            "noted": lambda: [
                _("Factor corrected"),
                _("Offset register corrected"),
                _("Another tool cuts it"),
                _("Nests or spindles differ"),
            ]
        },
    )
)


def _still_out(alarm: Alarm) -> str:
    data = alarm.data
    text = _(
        "{n} parts of {characteristic} in a row are out of tolerance, the newest off by {deviations}, although corrections in full were "
        "issued for {m} of them.{gain} Nothing is corrected through tool {tool} until this alarm is answered."
    )
    return text.format(
        n=data.get("parts"),
        m=data.get("corrected"),
        characteristic=called(alarm),
        deviations=", ".join(map(um, data.get("deviations", ()))),
        gain=f" {_cause(alarm)}" if "gain" in data else "",
        tool=alarm.tool_memory,
    )


def _cause(alarm: Alarm) -> str:
    """The gain of the corrections, and its likely cause."""
    gain = float(alarm.data["gain"])
    if gain < -0.25:
        cause = _("wrong sign of the factor?")
    elif gain < 0.25:
        cause = _("does the control use this offset?")
    elif gain < 0.75:
        cause = _("diameter taken for radius?")
    elif gain < 1.5:
        cause = _(
            "does another characteristic of the tool take them back? Look at the edge, the clamping and the probe."
        )
    else:
        cause = _("radius taken for diameter?")
    return _("The gain of the corrections is {gain} {pm} {error}, it should be 1: {cause}").format(
        gain=signed(gain, 2), pm=PLUS_MINUS, error=fixed(alarm.data["error"], 2), cause=cause
    )


STILL_OUT_OF_TOLERANCE = register(
    AlarmKind(
        STILL_OUT,
        concerns_parts=True,
        word=lambda: _("Still out of tolerance"),
        sentence=uncorrected(_still_out),
        what_to_do=lambda: _(
            "Were the corrections applied, or refused or rejected? Measure a part by hand. Look at the edge, the clamping and the probe. "
            "Check the factor of the characteristic (sign, radius or diameter), the offset register at the control, and whether another "
            "characteristic of this tool takes its corrections back. Then answer the alarm: parts before it no longer count."
        ),
        tone="stop",
        actions=("noted", "tool_replaced", "sister_tool"),
        comments={
            "noted": lambda: [
                _("Factor corrected"),
                _("Offset register corrected"),
                _("One characteristic measures only"),
                _("Clamping corrected"),
            ]
        },
    )
)


def _behind(alarm: Alarm) -> str:
    data = alarm.data
    text = _(
        "In each of the newest {n} readings of {characteristic} the time of measuring that the machine sends lies {lag} before its receipt: "
        "the clock of the machine is behind, or each reading waits as long on its way."
    )
    if data.get("number") is not None:
        text = _(
            "A reading of {characteristic} names correction {number}, which was issued {lag} after its part was cut, by the time that the "
            "machine sends: the clock of the machine is behind by as much or more, or the number is not that of the part."
        )
    counted = _(
        "Parts count as cut without corrections that tool {tool} had. Nothing is corrected through it until this alarm is answered."
    )
    if data.get("before"):
        counted = _(
            "Parts count as cut before tool {tool} was changed. Nothing is corrected through it until this alarm is answered."
        )
    return f"{text} {counted}".format(
        characteristic=called(alarm),
        lag=age(data.get("lag") or 0.0),
        n=data.get("readings"),
        number=data.get("number"),
        tool=alarm.tool_memory,
    )


def _early(alarm: Alarm) -> str:
    data = alarm.data
    if data.get("by") == "clock":
        return _behind(alarm)
    than = {
        "machined_at": _(
            "the time of cutting that the machine sends says ({lag} before the reading came in): the clock of the machine is behind"
        ),
        "correction_in_effect": _(
            "the number that the machine sends says: it is not that of the last correction applied"
        ),
    }.get(str(data.get("by")), _("they are confirmed: what is applied is reported late, or never"))
    return _(
        "Corrections of tool {tool} act earlier than {than}. {share} {pm} {error} of what counted as outstanding was in the sizes of "
        "{characteristic} already; {n} parts were on the way. Nothing is corrected through tool {tool} until this alarm is answered."
    ).format(
        tool=alarm.tool_memory,
        than=than.format(lag=age(data.get("lag") or 0.0)),
        share=signed(data.get("share"), 2),
        pm=PLUS_MINUS,
        error=fixed(data.get("error"), 2),
        characteristic=called(alarm),
        n=data.get("after"),
    )


EARLY_EFFECT = register(
    AlarmKind(
        EARLY,
        concerns_parts=True,
        word=lambda: _("Early effect"),
        sentence=uncorrected(_early),
        what_to_do=lambda: _(
            "Set the clock of the machine, or let it send the number of the last correction in place of the time of cutting "
            "(correction_in_effect, machined_at); confirm each correction before the next part is cut. Then answer the alarm: what was "
            "before it no longer counts."
        ),
        tone="stop",
        icon="waiting",
        comments={
            "noted": lambda: [
                _("Clock set"),
                _("Sends the number of the last correction"),
                _("Confirms before the next part"),
            ]
        },
    )
)


MOMENTS = ("applied_at", "machined_at", "issued_at")


def _in_doubt(alarm: Alarm) -> str:
    data = alarm.data
    if data["why"] == "clock":
        text = _(
            "In each of the newest {n} readings of {characteristic} the time of cutting that the machine sends lies {lag} before its receipt: "
            "corrections that were applied since then count as missing from the parts. That is right if each part is as long on its way to the gauge. If the "
            "clock of the machine is behind, they are taken back, or follow the wear by half."
        )
        if data.get("before"):
            text = _(
                "In each of the newest {n} readings of {characteristic} the time of cutting that the machine sends lies {lag} before its "
                "receipt: the parts count as cut before tool {of_tool} was changed, and correct nothing. That is right if each part is as long on its way to the gauge, "
                "and wrong if the clock of the machine is behind."
            )
        return text.format(
            characteristic=called(alarm),
            lag=age(data.get("lag") or 0.0),
            n=data.get("readings"),
            of_tool=data.get("of_tool"),
        )
    if data["why"] == "fell":
        fell = {
            "held": _("it is held"),
            "awaiting_approval": _("it awaits approval"),
            "rejected": _("it was rejected"),
        }.get(str(data.get("status")), _("it was dropped before it was applied"))
        return _(
            "A reading of {characteristic} says that its part was cut with correction {number}. That cannot be: {fell}. If the control has "
            "added it to tool {of_tool} all the same, the offset differs from what Inband counts."
        ).format(**data | {"characteristic": called(alarm)}, fell=fell)
    moments = {name: as_read(datetime.fromisoformat(data[name])) for name in data if name in MOMENTS}
    if data["why"] == "applied_before":
        text = _(
            "The machine says that it applied correction {number} of tool {of_tool} before it was issued. It was issued at {issued_at}, "
            "and applied at {applied_at} by the time that the machine sends. Either the clock of the machine is behind by {lag} or "
            "more, or it names another correction."
        )
        return text.format(**data | moments | {"lag": age(data.get("lag") or 0.0)})
    text = _(
        "A reading of {characteristic} names correction {number}, which was issued at {issued_at}. By the time that the machine sends, "
        "its part was cut before, at {machined_at}. Either the clock of the machine is behind, or the number is not that of the part."
    )
    return text.format(**data | moments | {"characteristic": called(alarm)})


CORRECTION_IN_DOUBT = register(
    AlarmKind(
        DOUBT,
        concerns_parts=True,
        word=lambda: _("Correction in doubt"),
        sentence=_in_doubt,
        what_to_do=lambda: _(
            "Look at the number of the last correction that the machine sends (correction_in_effect), and at its clock: the time of measuring "
            "beside that of cutting (measured_at, machined_at) shows if it is behind. Read the offset at the control; if it differs, "
            "enter it under Tools."
        ),
        icon="waiting",
        comments={
            "noted": lambda: [
                _("Program that sends the number corrected"),
                _("Clock set"),
                _("Parts are that long on their way"),
                _("Offset at the control is right"),
            ]
        },
    )
)


ANOTHER_UNIT = 8  # gain from which on no radius was taken for a diameter


def _unusual(alarm: Alarm) -> str:
    data = alarm.data
    values = {
        "tool": alarm.tool_memory,
        "gain": signed(data.get("gain"), 2),
        "pm": PLUS_MINUS,
        "error": fixed(data.get("error"), 2),
        "n": data.get("corrections"),
    }
    text = {
        "none": _(
            "The corrections of tool {tool} change nothing: gain {gain} {pm} {error} from {n} corrections. The control does not "
            "use this offset."
        ),
        "weak": _(
            "The corrections of tool {tool} act too weakly: gain {gain} {pm} {error} from {n} corrections, it should be 1. "
            "Diameter taken for radius?"
        ),
        "strong": _(
            "The corrections of tool {tool} act too strongly: gain {gain} {pm} {error} from {n} corrections, it should be 1. "
            "Radius taken for diameter?"
        ),
        "unit": _(
            "The corrections of tool {tool} act many times too strongly: gain {gain} {pm} {error} from {n} corrections, it should "
            "be 1. Is the offset in inches at the control, or in steps?"
        ),
    }.get(
        "unit" if data.get("verdict") == "strong" and data.get("gain", 0) >= ANOTHER_UNIT else str(data.get("verdict")),
        _(
            "The corrections of tool {tool} do the opposite of what they ask: gain {gain} {pm} {error} from {n} corrections, it "
            "should be 1. Wrong sign of the factor?"
        ),
    )
    return text.format(**values)


UNUSUAL_GAIN = register(
    AlarmKind(
        "unusual_gain",
        concerns_parts=True,
        word=lambda: _("Unusual gain"),
        sentence=_unusual,
        what_to_do=lambda: _(
            "Check the factor of the characteristic (radius or diameter), the offset register at the control, and which tool "
            "cuts it. Correcting goes on meanwhile; where parts swing out of tolerance, the tool is paused."
        ),
        comments={
            "noted": lambda: [_("Factor corrected"), _("Offset register corrected"), _("Another tool cuts it")],
        },
    )
)


def _disagree(alarm: Alarm) -> str:
    data = alarm.data
    return _(
        "{down} and {up} take each other's corrections of tool {tool} back: one asked for {mean_down}, the other for {mean_up}, "
        "{n} times in turn. One offset cannot bring both to their targets."
    ).format(
        down=data.get("down"),
        up=data.get("up"),
        mean_down=um(data.get("mean_down")),
        mean_up=um(data.get("mean_up")),
        n=data.get("times"),
        tool=alarm.tool_memory,
    )


CHARACTERISTICS_DISAGREE = register(
    AlarmKind(
        "characteristics_disagree",
        word=lambda: _("Characteristics disagree"),
        sentence=_disagree,
        what_to_do=lambda: _(
            "Check target, empirical value (R11) and factor of both, and whether this tool and edge cuts both. Else let one of "
            "them correct and the other measure only, or give it an offset of its own. Correcting goes on meanwhile."
        ),
        icon="hunting",
        comments={
            "noted": lambda: [
                _("Target corrected"),
                _("Factor corrected"),
                _("One measures only"),
                _("Another tool cuts it"),
            ],
        },
    )
)
