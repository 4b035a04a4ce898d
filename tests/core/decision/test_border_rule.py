"""The border rule of the zones in SQL against the same in Python."""

import random

import psycopg

from app.core.decision.limits import nanometres, nanometres_sql, within, within_sql


def test_sql_judges_as_python_does(postgres: str) -> None:
    chance = random.Random(5)
    limits = [0, 1_000, 8_000, 300_000]
    on_and_between = [sign * (limit + step / 2) / 1e6 for limit in limits for step in range(-3, 4) for sign in (-1, 1)]
    sizes = on_and_between + [chance.uniform(-0.4, 0.4) for _ in range(2_000)]
    with psycopg.connect(postgres) as connection:
        rows = connection.execute(
            f"SELECT {nanometres_sql('d')}, ARRAY(SELECT {within_sql('d', 'l')} FROM unnest(%s::bigint[]) AS limits(l)) "  # noqa: S608
            "FROM unnest(%s::float8[]) AS sizes(d)",
            [limits, sizes],
        ).fetchall()
    expected = [(nanometres(size), [within(nanometres(size), limit) for limit in limits]) for size in sizes]
    assert rows == expected
