"""Every code of statistics has its sentence, with its numbers in it."""

import pytest

from app.core.spc.capability import Caution
from app.core.spc.gauge.zero_range import Governs
from app.core.spc.refusal import Reason, Refused
from app.core.spc.rules import RULES, RuleName, Run
from app.core.spc.shewhart import Chart
from app.core.spc.spread import Estimator
from app.loop.summaries import wording


def test_every_code_has_words_of_its_own() -> None:
    told = [
        [wording.chart(each) for each in Chart],
        [wording.rule_name(each) for each in RuleName],
        [wording.rule(each) for each in RULES.values()],
        [wording.hint(each) for each in RuleName],
        [wording.estimator(each) for each in Estimator],
        [wording.refusal(Refused(each)) for each in Reason],
        [wording.caution(each) for each in Caution],
        [wording.governs(each) for each in Governs],
    ]
    for sentences in told:
        assert all(sentences)
        assert len(set(sentences)) == len(sentences)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        (RuleName.NELSON_1, "A point lies beyond 3 sigma."),
        (RuleName.NELSON_2, "9 points in a row lie on the same side of the centre."),
        (RuleName.NELSON_3, "6 points in a row rise, or fall."),
        (RuleName.NELSON_4, "14 points in a row go up and down by turns."),
        (RuleName.NELSON_5, "2 of 3 points in a row lie beyond 2 sigma on the same side."),
        (RuleName.NELSON_6, "4 of 5 points in a row lie beyond 1 sigma on the same side."),
        (RuleName.NELSON_7, "15 points in a row lie within 1 sigma of the centre."),
        (RuleName.NELSON_8, "8 points in a row lie beyond 1 sigma, on either side."),
        (RuleName.WESTERN_4, "8 points in a row lie on the same side of the centre."),
    ],
)
def test_rules_are_reported_with_their_numbers(name: RuleName, words: str) -> None:
    assert wording.rule(RULES[name]) == words


def test_a_refusal_says_how_much_is_missing() -> None:
    assert (
        wording.refusal(Refused(Reason.TOO_FEW_READINGS, have=12, needed=20))
        == "12 readings of the 20 that this takes: 8 are missing."
    )
    assert wording.refusal(Refused(Reason.TOO_FEW_SUBGROUPS, have=19, needed=20)).endswith("1 is missing.")
    assert "1 trials" in wording.refusal(Refused(Reason.INCOMPLETE_STUDY, have=1, needed=2, what="trials"))


def test_a_signal_says_on_which_side_it_lies() -> None:
    trend, side, alternating = (RULES[name] for name in (RuleName.NELSON_3, RuleName.NELSON_2, RuleName.NELSON_4))
    assert wording.side(Run(trend.name, 1, 0, 5, 6), trend) == "rising"
    assert wording.side(Run(side.name, -1, 0, 8, 9), side) == "below"
    assert wording.side(Run(alternating.name, 0, 0, 13, 14), alternating) == ""
