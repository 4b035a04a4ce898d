"""What `inband check` advises about standbys."""

import pytest

from app.db.replication import Replication, Standby, advice_on

ASYNC = Standby("db2", "streaming", "async", 0.1)
QUORUM = [Standby(name, "streaming", "quorum", 0.1) for name in ("db2", "db3")]


@pytest.mark.parametrize(
    ("names", "standbys", "words"),
    [
        ("", (), None),
        ("", (ASYNC,), "'ANY 1 (a, b)' with their names"),
        ("db2", (Standby("db2", "streaming", "sync", 0.1),), "With a second one"),
        ("ANY 1 (db2, db3)", QUORUM[:1], "With a second one"),
        ("ANY 1 (db2, db3)", QUORUM, None),
        (
            "FIRST 1 (db2, db3)",
            (Standby("db2", "streaming", "sync", 0.1), Standby("db3", "streaming", "potential", 0.1)),
            None,
        ),
        ("ANY 1 (db2, db3)", (ASYNC._replace(state="catchup"),), "answered 503"),
    ],
)
def test_two_standbys_of_which_one_must_confirm_are_recommended(
    names: str, standbys: tuple[Standby, ...], words: str | None
) -> None:
    advice = advice_on(Replication(names, "on", True, True, tuple(standbys)))
    assert len(advice) == (words is not None), advice
    assert words is None or words in advice[0]
