"""What is read for the charts that stand beside the zone chart: what the measuring variant yields. Never writes."""

from sqlalchemy.orm import Session

from app.characteristics.chart import reading_link
from app.characteristics.figures import ResultPoint, ResultRange
from app.characteristics.queries import Standing
from app.statistics import queries as statistics
from app.statistics.queries import Window


def results_of(
    session: Session, standing: Standing, window: Window, name: str
) -> tuple[list[ResultPoint], list[ResultRange]]:
    """What the variant has yielded, for its chart: single readings, or blocks of very many."""
    course = statistics.results_of(session, standing.characteristic, window, name)
    key = standing.characteristic.key
    return (
        [
            ResultPoint(each.sequence, each.value, each.sequence in course.excluded, reading_link(key, each.sequence))
            for each in course.results
        ],
        [
            ResultRange(*block, f"/characteristics/{key}?first={block.first}&through={block.last}&result={name}")
            for block in course.blocks
        ],
    )
