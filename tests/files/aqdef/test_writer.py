"""AQDEF files as they are written: what comes back, here and by a reader that others have written."""
# ruff: noqa: DTZ001 - the files name no zone

import re
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import pytest
from aqdefreader.file import DfqFile
from hypothesis import given
from hypothesis import strategies as st

from app.core.natural_limit import NaturalLimit
from app.files.aqdef import description as aqdef
from app.files.aqdef import values as aqdef_values
from app.files.aqdef.description import Source
from app.files.aqdef.fields import CATALOGUES as OF_A_FILE
from app.files.aqdef.fields import FIELDS, ROW
from app.files.aqdef.values import Measured, Value
from app.files.aqdef.writer import MISSING, Catalogues, Described, Part, Validity, Written, write
from tests.chance import examples

BEGIN = datetime(2026, 11, 23, 6, 0, 0)
PARTS = [Part("08/15", "Shaft", "lathe-1", "Lathe 1"), Part("4711", "Bush")]
SEAT = Described(0, "shaft-d40", "Seat Ø40", 40.0, 39.984, 40.0, gauge="Probe")
ROUNDNESS = Described(0, "shaft-rnd", "Roundness", None, 0.0, 0.005, natural_limit=NaturalLimit.LOWER)
BORE = Described(1, "bush-d8", "Bore", 8.0, 8.0, 8.015)
CATALOGUES = Catalogues(
    ["correction sent", "tool changed"],
    [("lathe-1", "Lathe 1")],
    [("probe", "Probe")],
    ["Eva"],
    ["offset", "correction"],
)


def read(path: Path) -> tuple[aqdef.Description, list[tuple[int, Measured]]]:
    source = Source.at(path)
    description = aqdef.describe(source)
    found = []
    for value in aqdef_values.values(source, description):
        assert isinstance(value, Value)
        measured = aqdef_values.read_value(value)
        if measured is not None:
            assert isinstance(measured, Measured)
            found.append((value.characteristic, measured))
    return description, found


def values() -> list[Written]:
    second = timedelta(seconds=1)
    return [
        Written(0, 39.9981, BEGIN, part="SN-1", events=("tool changed", "correction sent"), machine="lathe-1", gauge="probe",
                process={"offset": -0.0061, "correction": 17}, operator="Eva", nest=2, order="A-7"),
        Written(1, 0.0021, BEGIN + second, part="SN-1", order="A-7"),
        Written(0, 41.2, BEGIN + second, Validity.IMPLAUSIBLE, part="SN-2"),
        Written(2, 8.004, BEGIN + second, part="SN-3"),
        Written(2, 8.005, BEGIN + second),
        Written(0, 39.999, BEGIN + second),
    ]  # fmt: skip


def test_a_file_has_exactly_the_fields_that_the_table_calls_written(tmp_path: Path) -> None:
    path = tmp_path / "out.dfq"
    part = Part("08/15", "Shaft", "lathe-1", "Lathe 1", "Hall 2", "20")
    seat = SEAT._replace(importance=2)
    own = {"K0097": "{8e5c0f3a}"}
    full = values()[0]._replace(batch="7", comment="chip", fields=own)
    write(path, [part], [seat], [full], CATALOGUES)
    head = {"K0100"} | {each.key for each in OF_A_FILE.values()}
    found = set(re.findall(r"^(K\d{4})", path.read_text("cp1252"), flags=re.MULTILINE)) - head
    in_the_row = set(ROW)
    assert found | in_the_row == {key for key, field in FIELDS.items() if field.written}
    assert found.isdisjoint(in_the_row)


def test_what_is_written_is_read(tmp_path: Path) -> None:
    path = tmp_path / "out.dfq"
    done = write(path, PARTS, [SEAT, ROUNDNESS, BORE], values(), CATALOGUES)
    assert (done.values, done.lines, done.remarks) == (6, 5, [])
    assert [each.name for each in tmp_path.iterdir()] == ["out.dfq"]
    assert path.read_bytes().count(b"\r\n") == path.read_bytes().count(b"\n")
    description, found = read(path)
    assert description.encoding == "cp1252"
    seat, roundness, bore = description.characteristics.values()
    assert (seat.name, seat.fields["K2110"], seat.fields["K2112"], seat.fields["K2120"]) == (
        "Seat Ø40",
        "39.984",
        "-0.016",
        "1",
    )
    assert (roundness.fields["K2120"], roundness.fields["K2121"], "K2101" in roundness.fields) == ("2", "1", False)
    assert description.part_of(bore)["K1001"] == "4711"
    assert [(at, each.measured, each.part) for at, each in found] == [
        (1, 39.9981, "SN-1"), (2, 0.0021, "SN-1"), (1, 41.2, "SN-2"), (3, 8.004, "SN-3"), (3, 8.005, ""), (1, 39.999, ""),
    ]  # fmt: skip
    first = found[0][1]
    assert (first.at, first.nest, first.order, first.process) == (BEGIN, 2, "A-7", "1/-0.0061,2/17")
    assert [description.named(event, "K4223") for event in first.events] == ["tool changed", "correction sent"]
    assert (description.named(first.machine, "K4063"), description.named(first.gauge, "K4073")) == ("Lathe 1", "Probe")
    assert description.named(first.operator, "K4092") == "Eva"
    assert found[2][1].attribute == 290


def test_another_reader_finds_the_same(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "out.dfq"
    write(path, PARTS[:1], [SEAT, ROUNDNESS], [each for each in values() if each.characteristic < 2], CATALOGUES)
    seat, roundness = DfqFile(path.read_text("cp1252").splitlines()).get_part(0).get_characteristics()
    assert seat.get_data("K2002") == "Seat Ø40"
    found = [
        (each.value, each.attribute, each.datetime, each.nest_no, each.machine_no) for each in seat.get_measurements()
    ]
    later = BEGIN + timedelta(seconds=1)
    assert found == [(39.9981, 0, BEGIN, 2, 1), (41.2, 290, later, 0, 0), (39.999, 0, later, 0, 0)]
    first = seat.get_measurements()[0]
    assert (first.event, first.process_parameter, first.control_no) == ("2,1", "1/-0.0061,2/17", 1)
    assert [(each.value, each.datetime) for each in roundness.get_measurements()] == [(0.0021, later)]
    capsys.readouterr()


def test_texts_are_made_to_fit_and_it_is_said(tmp_path: Path) -> None:
    long = "bearing-seat-of-the-main-shaft"
    twice = [Described(0, f"{long}-{side}", "Ø\x0f40\x14", 40.0, 39.9, 40.1) for side in ("a", "b")]
    path = tmp_path / "out.dfq"
    done = write(path, [Part("1" * 31, "Шахта")], twice, [Written(0, 40.0, BEGIN, part="S;N\r\n1")], Catalogues())
    description, found = read(path)
    first, second = description.characteristics.values()
    assert (first.number, second.number) == ("bearing-seat-of-the-", "bearing-seat-of-~2")
    assert (first.name, found[0][1].part) == ("Ø 40", "S,N 1")
    assert description.encoding == "utf-8-sig"
    assert any("K1001 holds 30 characters" in remark for remark in done.remarks)
    assert any("has signs that K0014 cannot hold" in remark for remark in done.remarks)


@pytest.mark.parametrize("name", ["Härte Ø40", "Diamètre", "façade", "Muñoz", "Lærke", "Đorđe Petrović", "Ã¼"])
def test_letters_come_back_whatever_encodings_have_their_bytes(tmp_path: Path, name: str) -> None:
    path = tmp_path / "out.dfq"
    write(path, [Part("1", name)], [SEAT], [Written(0, 40.0, BEGIN, part=name, operator=name)], Catalogues())
    description, [(_at, measured)] = read(path)
    assert description.parts[1]["K1002"] == measured.part == description.named(measured.operator, "K4092") == name


def test_nothing_is_left_where_it_fails(tmp_path: Path) -> None:
    def failing() -> Any:
        yield values()[0]
        raise OSError("gone")

    with pytest.raises(OSError, match="gone"):
        write(tmp_path / "out.dfq", PARTS, [SEAT], failing(), CATALOGUES)
    assert list(tmp_path.iterdir()) == []


MOMENTS = st.integers(0, 20_000).map(lambda seconds: BEGIN + timedelta(seconds=seconds))
WRITTEN = st.builds(
    Written,
    characteristic=st.integers(0, 2),
    measured=st.floats(-1e5, 1e5).map(lambda value: round(value, 9) or 0.0),
    at=MOMENTS,
    validity=st.sampled_from(Validity),
    part=st.one_of(st.just(""), st.sampled_from(["A", "B", "C"]), st.text("äЖx ;\x0f", max_size=50)),
    events=st.lists(st.sampled_from(CATALOGUES.events), unique=True),
    order=st.sampled_from(["", "A-7"]),
    nest=st.integers(0, 12),
    machine=st.sampled_from(["", "lathe-1", "Mühle 2"]),
    operator=st.sampled_from(["", "Eva", "Ана"]),
    gauge=st.sampled_from(["", "probe", "Taster Ø2"]),
    batch=st.sampled_from(["", "C-1", "7"]),
    process=st.dictionaries(
        st.sampled_from(["offset", "T, °C"]), st.floats(-1e3, 1e3).map(lambda v: round(v, 6) or 0.0)
    ),
    comment=st.sampled_from(["", "chip, washed"]),
    fields=st.dictionaries(st.sampled_from(["K0015", "K0081"]), st.sampled_from(["10", "a b"])),
)


def circumstances(description: aqdef.Description, value: Measured) -> tuple[Any, ...]:
    named = description.named
    process = aqdef_values.process_of(value.process) if value.process else {}
    assert process is not None
    return (
        value.order,
        value.batch,
        value.nest,
        named(value.operator, "K4093"),
        named(value.gauge, "K4072"),
        named(value.machine, "K4062"),
        [named(event, "K4223") for event in value.events],
        {named(number, "K4243"): size for number, size in process.items()},
        value.text,
    )


@examples(40)
@given(st.lists(WRITTEN, max_size=30))
def test_every_value_comes_back_in_its_order(tmp_path_factory: pytest.TempPathFactory, written: list[Written]) -> None:
    path = tmp_path_factory.mktemp("aqdef") / "out.dfq"
    write(path, PARTS, [SEAT, ROUNDNESS, BORE], written, CATALOGUES)
    description, found = read(path)
    for index in range(3):
        mine = [each for each in written if each.characteristic == index]
        back = [each for at, each in found if at == index + 1]
        assert [(each.measured, each.attribute, each.at) for each in back] == [
            (each.measured, each.validity, each.at) for each in mine
        ]
        assert [circumstances(description, each) for each in back] == [
            (
                each.order, each.batch, each.nest, each.operator, each.gauge, each.machine, list(each.events),
                dict(each.process), each.comment,
            )
            for each in mine
        ]  # fmt: skip


@examples(25)
@given(st.lists(WRITTEN, max_size=20))
def test_another_reader_finds_every_value(tmp_path_factory: pytest.TempPathFactory, written: list[Written]) -> None:
    """It averages values of one time, so that each has a second of its own; it takes a file of one part."""
    path = tmp_path_factory.mktemp("aqdef") / "out.dfq"
    apart = [
        each._replace(characteristic=each.characteristic % 2, at=BEGIN + timedelta(seconds=at))
        for at, each in enumerate(written)
    ]
    write(path, PARTS[:1], [SEAT, ROUNDNESS], apart, CATALOGUES)
    encoding = aqdef.encoding_of(path)
    characteristics = DfqFile(path.read_text(encoding).splitlines()).get_part(0).get_characteristics()
    for index, characteristic in enumerate(characteristics):
        mine = [each for each in apart if each.characteristic == index]
        found = {
            each.datetime: (each.value, each.attribute, each.nest_no)
            for each in characteristic.get_measurements()
            if each.attribute != MISSING
        }
        assert found == {each.at: (each.measured, each.validity, each.nest) for each in mine}
