"""Touches as they are typed or pasted, and the picture that is drawn of them."""

from contextlib import suppress
from math import cos, hypot, isfinite, radians, sin
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.errors import Invalid
from app.geometry.work_zero import form_reader, pictures

lengths = st.floats(-1e5, 1e5).map(lambda value: round(value, 4))


def read(text: str, **more: str) -> dict[str, Any]:
    return form_reader.fields({"kind": "pocket", "lines": text} | more)[0]


class TestLines:
    @pytest.mark.parametrize(
        ("line", "touch"),
        [
            ("-X -353.012", {"x": -353.012, "approach": "-X"}),
            ("−X −353,012", {"x": -353.012, "approach": "-X"}),
            ("+y 12", {"y": 12.0, "approach": "+Y"}),
            ("X-353.012 Y+4 -X", {"x": -353.012, "y": 4.0, "approach": "-X"}),
            ("X = 1.5; Y = -2", {"x": 1.5, "y": -2.0}),
            ("12,5\t-3,25", {"x": 12.5, "y": -3.25}),
            ("12.5, -3.25", {"x": 12.5, "y": -3.25}),
            ("10 20 +Y", {"x": 10.0, "y": 20.0, "approach": "+Y"}),
            ("Y7 -Y", {"y": 7.0, "approach": "-Y"}),
        ],
    )
    def test_a_touch(self, line: str, touch: dict[str, Any]) -> None:
        assert read(line)["touches"] == [touch]

    @pytest.mark.parametrize(
        "line", ["12", "X", "-X", "1 2 3", "-X +Y 5", "burr here", "X1 X", "1.2.3 4", "nan 5", "-X 5 6 7"]
    )
    def test_what_is_none_is_named_by_its_line(self, line: str) -> None:
        with pytest.raises(Invalid) as refused:
            read(f"-X 1\n\n{line}")
        assert refused.value.errors[0].field == "lines"
        assert "line 3" in refused.value.errors[0].message

    @pytest.mark.parametrize(
        "text",
        [
            "R1=12 R2=60\nR3=7 R4=43",
            "R1 12\nR2 60,0\nR3 7\nR4 43",
            "#501=12. #502=60. #504=7. #505=43.",
            "r4=43; r3=7; r2=60; r1=12",
        ],
    )
    def test_what_the_printed_macros_keep(self, text: str) -> None:
        made = read(text)
        assert "touches" not in made
        assert sorted(value for name, value in made.items() if name[0] in "R#") == [7.0, 12.0, 43.0, 60.0]

    def test_with_z_of_the_macro(self) -> None:
        made = read("#501=53 #502=-53 #504=-33 #505=37 #508=-150.0 #2=0.1")
        assert (made["z_touched"], made["feeler"]) == (-150.0, 0.1)

    def test_rows_and_lines_together(self) -> None:
        made, typed_in = form_reader.fields(
            {"kind": "pocket", "x1": "-353,012", "approach1": "−X", "y3": "4", "approach3": "", "lines": "+X 259"}
        )
        assert made["touches"] == [{"x": -353.012, "approach": "-X"}, {"y": 4.0}, {"x": 259.0, "approach": "+X"}]
        assert typed_in == ["touch1", "touch3", "lines"]

    def test_too_much(self) -> None:
        with pytest.raises(Invalid):
            read("1 2\n" * 6000)

    @given(st.text(max_size=300))
    def test_anything_is_read_or_refused(self, text: str) -> None:
        with suppress(Invalid):
            assert "kind" in read(text)


KINDS = tuple(pictures.SCHEMATIC)


class TestPicture:
    @pytest.mark.parametrize("kind", KINDS)
    def test_tips_touch_the_wall_and_come_from_the_free_side(self, kind: str) -> None:
        """In the schematic the tip is to scale: its edge lies on the outline, the tail of its arrow in free space."""
        drawn = pictures.schematic(kind)
        assert drawn.zero[0] is not None
        assert drawn.zero[1] is not None
        for tip in drawn.tips:
            assert tip.arrow is not None
            tail, head = (
                hypot(tip.arrow[0] - tip.x, tip.arrow[1] - tip.y),
                hypot(tip.arrow[2] - tip.x, tip.arrow[3] - tip.y),
            )
            assert tail > head > tip.radius
            if drawn.circle:
                x, y, radius = drawn.circle
                away = hypot(tip.x - x, tip.y - y)
                assert away == pytest.approx(radius - tip.radius if drawn.inside else radius + tip.radius, abs=0.1)
                assert (hypot(tip.arrow[0] - x, tip.arrow[1] - y) < away) is drawn.inside
            else:
                inwards = hypot(tip.arrow[0] - drawn.zero[0], tip.arrow[1] - drawn.zero[1]) < hypot(
                    tip.x - drawn.zero[0], tip.y - drawn.zero[1]
                )
                assert inwards is drawn.inside or kind == "corner"

    def test_y_points_up(self) -> None:
        touches = [{"x": 0.0, "y": 10.0, "approach": "+Y"}, {"x": 0.0, "y": -10.0, "approach": "-Y"}]
        drawn = pictures.draw("pocket", touches, {"x": None, "y": 0.0, "width": 26.0}, 6.0)
        assert drawn.tips[0].y < drawn.tips[1].y
        assert drawn.zero[0] is None
        assert drawn.size == "26.000"

    def test_turned_counter_clockwise(self) -> None:
        drawn = pictures.draw("web", [], {"x": 0.0, "y": 0.0, "length": 100.0, "width": 50.0, "rotation": 10.0}, 0.0)
        first, second = (point.split() for point in drawn.outline[1:-1].split("L")[:2])
        rise = float(first[1]) - float(second[1])
        assert rise / (float(second[0]) - float(first[0])) == pytest.approx(
            sin(radians(10)) / cos(radians(10)), abs=1e-3
        )

    @given(
        kind=st.sampled_from(KINDS),
        places=st.lists(
            st.tuples(lengths | st.none(), lengths | st.none(), st.sampled_from(["+X", "-X", "+Y", "-Y", None])),
            max_size=8,
        ),
        values=st.fixed_dictionaries(
            {name: lengths | st.none() for name in ("x", "y")}
            | {name: st.floats(0.001, 1e5) | st.none() for name in ("diameter", "length", "width")}
        ),
        tip=st.floats(0, 1000),
    )
    def test_everything_lies_in_the_picture(
        self, kind: str, places: list[Any], values: dict[str, Any], tip: float
    ) -> None:
        touches = [{"x": x, "y": y, "approach": approach} for x, y, approach in places]
        drawn = pictures.draw(kind, touches, values, tip)
        for each in drawn.tips:
            assert -1 <= each.x <= drawn.width + 1
            assert -1 <= each.y <= drawn.height + 1
            assert isfinite(each.radius)
        numbers = [float(number) for number in drawn.outline.strip("MZ").replace("L", " ").split()]
        assert all(-1 <= number <= drawn.width + 1 for number in numbers)
