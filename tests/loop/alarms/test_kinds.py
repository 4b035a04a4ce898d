"""The registry of alarm kinds: complete in every process, and each kind can be shown."""

import subprocess
import sys

import pytest

from app.loop.alarms.kinds import AlarmKind, kind_named, kinds, register
from app.loop.tables.alarms import Alarm
from app.web import states
from app.web.templates import environment


@pytest.mark.parametrize("kind", list(kinds()), ids=lambda kind: kind.name)
def test_every_kind_has_a_word_an_icon_and_advice(kind: AlarmKind) -> None:
    badge = environment().from_string('{% import "components.html" as ui %}{{ ui.badge(name) }}').render(name=kind.name)
    assert kind.word() in badge
    assert "<path" in badge
    assert kind.what_to_do()
    assert kind.actions
    assert states.tone_of(kind.name) == kind.tone


def test_a_process_that_uses_one_room_only_words_the_alarms_of_all() -> None:
    program = "from app.loop.alarm_response.wording import kind_word; print(kind_word('fixture_shifted'))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.stdout == "Fixture shifted\n", done.stderr


def test_a_kind_of_a_newer_version_is_shown_by_its_name() -> None:
    kind = kind_named("coolant_low")
    assert (kind.word(), kind.sentence(Alarm(kind="coolant_low", data={"text": "Low."}))) == ("coolant_low", "Low.")
    assert "noted" in kind.actions


def test_a_name_is_taken_once() -> None:
    with pytest.raises(ValueError, match="two alarm kinds are called signal"):
        register(kind_named("signal"))
