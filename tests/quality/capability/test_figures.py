"""Pictures of capability where there is little room."""

from app.charts.description import Axis, Chart, Note, Panel, Share
from app.quality.capability.figures import BELOW, small


def test_readings_beyond_are_named_in_place_of_the_axis_where_there_is_little_room() -> None:
    def drawn(*notes: Note) -> str:
        return small(Chart([Panel(notes)], Axis("Deviation, µm"))).x.title

    assert drawn() == "Deviation, µm"
    assert drawn(Note("2 readings beyond", Share(1), BELOW)) == ""
