"""The picture in a mail: the last deviations between the limits, those outside marked."""

import logging
from collections.abc import Sequence
from functools import cache
from io import BytesIO
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from app.core.decision.limits import Zone, within_tolerance
from app.core.parameters import Parameters
from app.language.formatting import read_um
from app.loop.alarm_response.queries import AlarmRow
from app.loop.characteristics.queries import parameters_of
from app.loop.tables.readings import Reading

log = logging.getLogger(__name__)

READINGS = 30
WIDTH, HEIGHT, LABELS = 640, 220, 110
INK, LIMIT, GRID, OUT = "#1c2327", "#5b6770", "#c8ced2", "#b34700"
REACH = 2.0
"""Times the tolerance from the target, at most: what lies further out is drawn at the edge."""


def of_last_readings(session: Session, row: AlarmRow) -> bytes | None:
    """The last readings of the characteristic of an alarm, as PNG; None where there are none. A mail does not fail for want of it."""
    if row.characteristic is None:
        return None
    here = (Reading.machine_id == row.machine.id, Reading.characteristic_id == row.characteristic.id)
    query = select(Reading.deviation, Reading.parameters_version).where(*here, Reading.zone != Zone.PROBE_FAULT.value)
    last = session.execute(query.order_by(Reading.sequence.desc()).limit(READINGS)).all()
    if not last:
        return None
    parameters = parameters_of(session, row.machine.id, row.characteristic.id, last[0].parameters_version)
    try:
        return drawn([each.deviation for each in reversed(last)], parameters)
    except Exception:
        log.exception("the last readings of alarm %d cannot be drawn", row.alarm.id)
        return None


def drawn(deviations: Sequence[float], parameters: Parameters) -> bytes:
    """Deviations in mm, oldest first, as PNG."""
    from PIL import Image, ImageDraw  # a tenth of a second, which a server without mails need not spend

    half = max(parameters.half, 1e-6)
    reach = max(1.0, min(REACH, max(abs(each) for each in deviations) / half)) * half * 1.15
    picture = Image.new("RGB", (WIDTH, HEIGHT), "white")
    on, font = ImageDraw.Draw(picture), _font()

    def y(deviation: float) -> float:
        return HEIGHT / 2 - max(-1.0, min(1.0, deviation / reach)) * (HEIGHT / 2 - 12)

    def label(deviation: float, colour: str) -> None:
        at = min(max(y(deviation), 10), HEIGHT - 10)
        words = read_um(deviation, half).replace("\N{NO-BREAK SPACE}", " ")
        on.text((WIDTH - LABELS + 14, at), words, colour, font, "lm")

    on.line([(0, y(0)), (WIDTH - LABELS, y(0))], GRID, 1)
    for limit in parameters.tolerance.judged:
        on.line([(0, y(limit)), (WIDTH - LABELS, y(limit))], LIMIT, 2)
        if abs(y(limit) - y(deviations[-1])) > 18:
            label(limit, LIMIT)
    step = (WIDTH - LABELS - 20) / max(len(deviations) - 1, 1)
    points = [(10 + at * step, y(each)) for at, each in enumerate(deviations)]
    on.line(points, INK, 2)
    for (x, at), each in zip(points, deviations, strict=True):
        inside = within_tolerance(each, parameters.limits)
        r = 3 if inside else 6
        on.ellipse((x - r, at - r, x + r, at + r), INK if inside else OUT)
    label(deviations[-1], INK if within_tolerance(deviations[-1], parameters.limits) else OUT)
    target = BytesIO()
    picture.save(target, "PNG")
    return target.getvalue()


@cache
def _font() -> Any:
    """That of the reports; the one of Pillow has neither µ nor a minus sign."""
    import pymupdf_fonts
    from PIL import ImageFont

    return ImageFont.truetype(BytesIO(pymupdf_fonts.fontbuffers["figo"]()), 16)  # type: ignore[no-untyped-call]
