"""Sentences on the column of times of a file: taken under a name that is not known, missing, or asked about."""

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


def times_in_doubt(columns: str, days: str) -> str:
    """The question which of these columns of dates holds the times. days: the column of days that has a name for them, if there is one."""
    words = _(
        "Dates stand under {columns}, and no column has a known name for the time of measuring. Say which it is (measured_at=COLUMN), or "
        "that none is (measured_at=); then every reading gets the time of the import."
    )
    if days:
        words = _(
            "{days} holds days without a time of day, and dates with one stand under {columns}. Say which is the time of measuring: "
            "measured_at=COLUMN, or measured_at={days} for the midnight at the beginning of each day."
        )
    return words.format(columns=columns, days=days)


def counted_in_doubt(columns: str, number: str, form: str) -> str:
    """The question if these columns of numbers hold the times. number: the first. form: that reads them as times, if they need one."""
    words = _(
        "The numbers under {columns} ({number} is the first) may be times, and no column has a known name for the time of measuring. If "
        "they are, say so (measured_at=COLUMN{form}); if not, that none is (measured_at=): then every reading gets the time of the import."
    )
    said = _(" with the form of times “{form}”, --time-format").format(form=form) if form else ""
    return words.format(columns=columns, number=number, form=said)
