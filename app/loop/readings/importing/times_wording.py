"""Sentences on the column of times of a file: taken under a name that is not known, missing, or asked about."""

from collections.abc import Mapping, Sequence

from app.files.formats.file_times import Unnamed
from app.language.i18n import _


def on_times(column: str, days: str, *, taken: bool) -> str:
    """A sentence on the column that is read as times; empty where its name or a person says that it holds them.

    days: the column whose name says so, and that holds days alone. taken: the name of the column does not say it.
    """
    if not column:
        return _("There is no column of times: every reading gets the time of this import.")
    if not days and not taken:
        return ""
    if not days:
        words = _(
            "No column has a known name for the time of measuring. {column} is taken for it: it alone has a date and a time in every line. "
            "If it is something else, leave it out (--map measured_at=)."
        )
    elif taken:
        words = _(
            "{days} holds days without a time of day. {column} is taken for the time of measuring: it alone has a time on the same day in "
            "every line. If it is something else, name the days (--map measured_at={days})."
        )
    else:
        words = _(
            "{days} holds days without a time of day: every reading gets the midnight at the beginning of its day. If another column has "
            "the time of day, name both (--map measured_at={days}+COLUMN)."
        )
    return words.format(column=column, days=days)


def in_doubt(found: Unnamed, columns: Mapping[str, Sequence[str]], header: Sequence[str], days: str) -> str:
    """The question which column holds the times; empty where none may. columns: by their places in the header. days: as `on_times`."""
    names = ", ".join(header[int(at)] or str(int(at) + 1) for at in (*found.doubtful, *found.counted))
    if found.counted:
        place, form = next(iter(found.counted.items()))
        words = _(
            "The numbers under {columns} ({number} is the first) may be times, and no column has a known name for the time of measuring. If "
            "they are, say so (measured_at=COLUMN{form}); if not, that none is (measured_at=): then every reading gets the time of the import."
        )
        said = _(" with the form of times “{form}”, --time-format").format(form=form) if form else ""
        return words.format(columns=names, number=columns[place][0], form=said)
    words = _(
        "Dates stand under {columns}, and no column has a known name for the time of measuring. Say which it is (measured_at=COLUMN), or "
        "that none is (measured_at=); then every reading gets the time of the import."
    )
    if days:
        words = _(
            "{days} holds days without a time of day, and dates with one stand under {columns}. Say which is the time of measuring: "
            "measured_at=COLUMN, or measured_at={days} for the midnight at the beginning of each day."
        )
    return words.format(columns=names, days=days) if names else ""
