"""Loops over text of others take ten times as long for ten times the text, not a hundred times (expressions: tests/test_expressions.py).

The limits are seconds of a processor, a hundred times what is needed; what grows with the square of its input needs minutes.
"""

import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from app import logs
from app.core import fits, natural_limit, number_text
from app.core.printed_line import LineReader
from app.core.rotary import results
from app.errors import Invalid
from app.files.aqdef import description as aqdef
from app.files.aqdef import times as aqdef_times
from app.files.aqdef import values as aqdef_values
from app.files.aqdef.description import Source
from app.files.formats import cell_values, delimited, letters, markup, units
from app.files.formats.rotary_protocol import read_protocol
from app.geometry.alignment import form_reader as alignment
from app.geometry.geometric_form import form_reader as geometric_form
from app.geometry.rotary_axes import form_reader as rotary_axes
from app.geometry.work_zero import form_reader as work_zero
from app.loop.programs import queries as programs
from app.loop.readings.importing.layout import Wishes, look
from app.quality.baselines import form_reader as baselines
from app.quality.count_charts.pages import typed
from app.quality.gauge_studies import table_reader
from app.web import forms

MOST = 3.0  # s of a processor
LONG = 100_000  # characters: a cell of CSV may have 131,072
TEXTS = (
    "1", "1 ", "1.", "1,", "1/2,", "-1", "+", " ", "\t", "(", "[(<", "( ", "a", "a ", "a.", "Ä", "_m", "=", ";+", ";+1", "K1001 ",
    "K0001/1/", "¤", "\x0f", "\x14", "\n", '"', "e", "1e", ":", "1:1", "x=1 ", "ex0c ", "achse ", "\u0316\u0301", "<a ", "mm ",
)  # fmt: skip
"""Repeated, and with a sign behind them that fits nowhere."""


def seconds(call: Callable[..., Any], *given: Any) -> float:
    begun = time.thread_time()
    with suppress(ValueError, Invalid):
        call(*given)
    return time.thread_time() - begun


@pytest.mark.parametrize(
    "call",
    [
        cell_values.folded,
        units.unit_in,
        units.length_unit,
        delimited.is_value,
        delimited.defused,
        lambda text: delimited.decimal_of([text]),
        lambda text: delimited.like_thousands([text]),
        lambda text: cell_values.number(text, "."),
        lambda text: cell_values.number("(" + text, "."),
        lambda text: cell_values.moment(text, None),
        lambda text: cell_values.moment(text, None, "%d.%m.%Y %H:%M"),
        aqdef_times.time_of,
        cell_values.slashed,
        aqdef_values.number_of,
        aqdef_values.process_of,
        aqdef_values._with_separators,
        aqdef_values._several,
        aqdef_values._entry,
        number_text.has_broken_number,
        lambda text: letters.guessed(text.encode("cp1252", "replace")),
    ],
)
def test_what_is_made_of_a_cell(call: Callable[[str], Any]) -> None:
    for text in TEXTS:
        long = text * (LONG // len(text)) + "x"
        with suppress(units.UnknownUnit):
            assert seconds(call, long) < MOST, text


@pytest.mark.parametrize(
    "call",
    [
        table_reader.cells_of,
        lambda text: alignment.line(text, 1),
        lambda text: geometric_form.sections(text, "touches"),
        lambda text: work_zero.fields({"lines": text[: work_zero.MOST_LETTERS]}),
        lambda text: rotary_axes.run({"as": "positions", "positions": text}),
        results.read_results,
        forms.lengths,
        baselines.runs,
        lambda text: typed(text, ""),
        forms.whole_numbers,
        fits.fit_of,
        natural_limit.looks_natural,
        programs.guessed,
        logs.without_secrets,
        lambda text: LineReader().feed(text.encode()),
    ],
)
def test_what_is_pasted_printed_or_sent(call: Callable[[str], Any]) -> None:
    for text in (
        *TEXTS,
        "\t",
        "1\t",
        "1\n",
        "QS144=",
        "R1=",
        "#501=",
        "Z1\n",
        "1-2 a\n",
        "INBLINE",
        "/import/",
        "password=",
    ):
        for long in (text * (LONG // 5 // len(text)), "1" + text * (LONG // 5 // len(text)) + "\x00"):
            assert seconds(call, long) < MOST / 6, text


def test_a_pasted_row_of_empty_cells() -> None:
    assert seconds(table_reader.cells_of, "1" + "\t" * LONG) < MOST / 6


HEADS = "".join(f"K2001/{index} D{index}\n" for index in range(1, 9_001))
AQDEF = {
    "parts without a number": "K1001 a\n" + "".join(f"K1001 p{n}\nK2001/{n + 1} x\n" for n in range(9_000)),
    "parts without characteristics": HEADS + "".join(f"K1001/{n} p{n}\n" for n in range(2, 30_000)),
    "fields for all that are open": HEADS + "\x0f".join(["1"] * 9_000) + "\n" + "K0014/0 x\n" * 20_000,
    "short lines of many characteristics": HEADS + "1\n" * 30_000,
    "K lines of many characteristics": HEADS + "".join(f"K0001/{n % 9_000 + 1} 1\n" for n in range(30_000)),
    "a tree": HEADS + "".join(f"K5111/{n} 1\nK5103/{n} {n + 1}\nK5102/{n} 1\n" for n in range(20_000)),
    "fields by the numbers of values": HEADS + "".join(f"K0014/1/{n} x\n" for n in range(30_000)) + "1\n" * 30_000,
}


@pytest.mark.parametrize("name", AQDEF)
def test_loops_over_aqdef(tmp_path: Path, name: str) -> None:
    path = tmp_path / "a.dfq"
    path.write_text(AQDEF[name])
    source = Source(path, None, "utf-8")

    def read() -> None:
        for _value in aqdef_values.values(source, aqdef.describe(source)):
            pass

    assert seconds(read) < MOST


@pytest.mark.parametrize(
    "text", ["(" * LONG + ";b", "1" * LONG + "x;1", '"' * LONG, ";" * 400 + "\n", "(a;" * 400 + "\n"]
)
def test_the_beginning_of_a_table(tmp_path: Path, text: str) -> None:
    path = tmp_path / "a.csv"
    path.write_text(f"{text}\n" * 60)
    assert seconds(lambda: look(path, Wishes(), complete=False)) < MOST


@pytest.mark.parametrize(
    "text",
    [
        *TEXTS, "<", "<!--", "<![", "<!DOCTYPE a [", "<?", "</", "<a b=", '<a b="', "<script>", "<svg>", "&", "&#", "<td>1</td>",
        "Lose: 0,1\n", "C-Achse\n", "<td>EXC</td>", "<svg></style>", "<![\n",
    ],
)  # fmt: skip
def test_a_protocol(text: str) -> None:
    long = text * (LONG // len(text))
    assert seconds(read_protocol, long) < MOST
    assert seconds(read_protocol, "<h2>C-Achse</h2><table><tr><td>Lose</td>" + long) < MOST


def test_silent_elements_within_each_other() -> None:
    assert seconds(markup.rows_of, "<svg>" * LONG + "</style>" * LONG) < MOST
