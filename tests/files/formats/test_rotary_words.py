"""The table of words of rotary protocols, and what a plant may add to it."""

from pathlib import Path

import pytest

from app import HOUSE
from app.errors import Invalid
from app.files.formats.rotary_protocol import AxisProtocol, Protocol, read_protocol
from app.files.formats.rotary_words import known_words

HOW_TO = (HOUSE / "docs" / "how-to" / "rotary-axes.md").read_text(encoding="utf-8")
ITALIAN = HOW_TO.partition("```toml\n")[2].partition("```")[0]
PROTOCOL = (
    "<h2>Asse C</h2><p>Deviazione standard (ottimizzata): 0,0021</p><p>Deviazione standard: 0,0134</p>"
    "<p>Gioco medio, se Q423: 0,002</p><p>Posizione prima: X 250 Y 0 Z -120</p>"
)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "words.toml"


def read(path: Path, text: str, words: str) -> Protocol:
    path.write_text(words, encoding="utf-8")
    return read_protocol(text, known_words(path))


def test_the_example_of_the_how_to_reads_a_protocol(path: Path) -> None:
    assert read_protocol(PROTOCOL).axes == {}
    made = read(path, PROTOCOL, "\ufeff" + ITALIAN)
    assert made.unread == []
    assert made.axes == {
        "C": AxisProtocol(
            {"scatter_after": 0.0021, "scatter_before": 0.0134, "backlash": 0.002}, {"before": (250.0, 0.0, -120.0)}
        )
    }


def test_the_how_to_names_every_meaning() -> None:
    assert [meaning for meaning in known_words().meanings if f"`{meaning}`" not in HOW_TO] == []


@pytest.mark.parametrize(
    ("words", "line", "key"),
    [
        ('[greatest]\nlabels = ["Massimo"]', "Massimo dell’asse: 0.01", "greatest"),
        ('[greatest]\nlabels = ["ERRORE  Mássimo [mm]:"]', "Errore massimo: 0.01", "greatest"),
        ('[greatest]\nlabels = ["Errore massimo C axis"]', "Errore massimo: 0.01", "greatest"),
        ('[greatest]\nstems = ["mass err"]', "Errori massimi: 0.01", "greatest"),
        ('[radius]\nstems = ["=raggio"]', "Il raggio: 0.01", "radius"),
        ('[greatest]\nlabels = ["Errore"]\n[mean_error]\nlabels = ["Errore medio"]', "Errore medio: 0.01", "mean_error"),
    ],
)  # fmt: skip
def test_words_of_a_plant(path: Path, words: str, line: str, key: str) -> None:
    made = read(path, f"<h2>C axis</h2><p>Backlash: 0.1</p><p>{line}</p>", words)
    assert (made.axes["C"].numbers, made.unread) == ({"backlash": 0.1, key: 0.01}, [])


def test_words_of_a_plant_never_change_known_ones(path: Path) -> None:
    """`Gemittelte` is no known label, but one by its stems goes on from it."""
    line = "<h2>C axis</h2><p>Gemittelte Abweichung: 0.01</p>"
    assert read(path, line, '[points]\nlabels = ["Gemittelte"]').axes == read_protocol(line).axes


def test_headings_of_a_plant(path: Path) -> None:
    made = read(
        path,
        "<p>Protocollo di misura</p><p>Asse: C</p><p>Lose: 1</p>",
        ITALIAN + '[title]\nlabels = ["Protocollo di misura"]',
    )
    assert (made.axes["C"].numbers, made.unread) == ({"backlash": 1.0}, [])


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ('[backlash]\nlabels = ["Größter Fehler"]', "[backlash] “Größter Fehler” is known as [greatest] already"),
        ('[points]\nlabels = ["Lose der Achse"]', "is known as [backlash] already"),
        ('[points]\nstems = ["=lose"]', "is known as [backlash] already"),
        ('[points]\nlabels = ["Gioco"]\n[radius]\nlabels = ["gioco"]', "[radius] “gioco” is known as [points] already"),
        ('[points]\nstems = ["gioc"]\n[radius]\nstems = ["Gioc"]', "[radius] “Gioc” is known as [points] already"),
        ('[axis]\nlabels = ["Lose"]', "[axis] “Lose” is known as [backlash] already"),
        ('[optimised]\nstems = ["standard"]', "[optimised] “standard” is known as [scatter] already"),
        ('[earlier]\nstems = ["optimi"]', "[earlier] “optimi” is known as [optimised] already"),
        ('[setting]\nstems = ["lose"]', "[setting] “lose” is known as [backlash] already"),
        ('[gioco]\nlabels = ["Gioco"]', "[gioco] is no meaning. The meanings are created, time,"),
        ('labels = ["Gioco"]', "[labels] is no meaning"),
        ('[backlash]\nlabel = ["Gioco"]', 'holds something else than labels and stems. Write labels = ["one"'),
        ('[backlash]\nlabels = "Gioco"', "holds something else"),
        ("[backlash]\nlabels = [1]", "holds something else"),
        ('[setting]\nlabels = ["x"]', "holds something else than stems"),
        ("backlash = 1", "holds something else"),
        ('[backlash]\nlabels = [" (x) "]', "is too short"),
        ('[backlash]\nlabels = ["C axis"]', "is too short"),
        ('[backlash]\nstems = ["gioco a"]', "is too short"),
        ('[backlash]\nstems = ["="]', "is too short"),
        ('[axis]\nlabels = ["*"]', "is too short"),
        ("[backlash\n", "is not TOML in UTF-8: "),
    ],
)  # fmt: skip
def test_what_contradicts_or_says_nothing_is_refused(path: Path, words: str, said: str) -> None:
    with pytest.raises(Invalid) as refused:
        read(path, "", words)
    sentence = f"{refused.value.detail} {refused.value.what_to_do}"
    assert sentence.startswith(f"INBAND_ROTARY_WORDS: {path}: ")
    assert said in sentence


def test_a_file_that_cannot_be_read_is_refused(path: Path) -> None:
    with pytest.raises(Invalid, match="No such file"):
        known_words(path)
    with pytest.raises(Invalid, match="Is a directory"):
        known_words(path.parent)
    path.write_bytes(b'[backlash]\nlabels = ["L\xe4ufe"]')
    with pytest.raises(Invalid, match="is not TOML in UTF-8"):
        known_words(path)


def test_columns_of_before_and_after_are_told_apart() -> None:
    """Whatever they are called; where they are not told apart, none is read."""
    table = "<table><tr><th>Winkel<th>EXC {}<th>EXC {}<tr><td>0<td>0.01<td>0.02</table>"
    for before, after in (
        ("vor Optimierung", "nach Optimierung"),
        ("measured", "optimised"),
        ("uncompensated", "compensated"),
        ("pred kompenzacijo", "po kompenzaciji"),
    ):
        (row,) = read_protocol("C axis\n" + table.format(before, after)).axes["C"].deviations
        assert (row.measured[0], row.optimised[0]) == (0.01, 0.02)
    made = read_protocol("C axis\n" + table.format("prima", "dopo"))
    assert made.axes == {}
    assert len(made.unread) == 2


@pytest.mark.parametrize(
    "label", ["Lose, Winkelbereich Q432", "Backlash angle range", "Zračnost, kompenzacija", "Kompenzirana zračnost"]
)
def test_a_backlash_that_was_set_is_none_that_was_found(label: str) -> None:
    made = read_protocol(f"<h2>C axis</h2><p>{label}: 3</p>")
    assert (made.axes, len(made.unread)) == ({}, 1)


@pytest.mark.parametrize(
    ("label", "key"),
    [
        ("Standardno odstopanje po kompenzaciji", "scatter_after"),
        ("Razpršenost po popravku", "scatter_after"),
        ("Standardno odstopanje pred kompenzacijo", "scatter_before"),
        ("Standardno odstopanje po oseh", "scatter_before"),
    ],
)
def test_a_scatter_after_the_correction_in_slovene_is_told_from_that_before(label: str, key: str) -> None:
    made = read_protocol(f"<h2>C os</h2><p>{label}: 0.0021</p>")
    assert made.axes["C"].numbers == {key: 0.0021}
