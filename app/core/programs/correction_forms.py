"""Forms of the text that changes offsets, apart from the writing of it, which the command line reads only when it writes."""

from enum import StrEnum


class Form(StrEnum):
    """Form of the text that changes offsets.

    turning, milling: Sinumerik with `$TC_DP` variables, T = R10, D1. wear_variables: `#[2700+n]`, as the lathe line has
    them; wear_variables_2000: `#[2000+n]` for X and `#[2100+n]` for Z, the wear of Fanuc's own lathes. g10: `G10 P U W`.
    g10_absolute: `G10 P X Z`, for controls without user macros. list: for people, on any control.
    """

    TURNING = "turning"
    MILLING = "milling"
    WEAR_VARIABLES = "wear_variables"
    WEAR_VARIABLES_2000 = "wear_variables_2000"
    G10 = "g10"
    G10_ABSOLUTE = "g10_absolute"
    LIST = "list"


FORMS: dict[str, tuple[Form, ...]] = {
    "sinumerik": (Form.TURNING, Form.MILLING, Form.LIST),
    "fanuc": (Form.WEAR_VARIABLES, Form.WEAR_VARIABLES_2000, Form.G10, Form.G10_ABSOLUTE, Form.LIST),
    "heidenhain": (Form.LIST,),
    "other": (Form.LIST,),
}
"""The forms for each control; the first is taken where none is named."""
