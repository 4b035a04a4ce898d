"""The colours of a chart, named by what they are for; the same as in `frontend/static/css/tokens.css` (a test compares them).

ISA-101: quiet greys while all is well; colour only for what needs someone, and never colour alone.
"""

from dataclasses import dataclass
from typing import Literal

ThemeName = Literal["light", "dark"]
Role = Literal[
    "surface",  # behind a chart
    "ink",  # what is read first
    "quiet",  # what is read second
    "faint",  # axis lines
    "grid",
    "steady",  # readings that need nobody
    "average",  # the running average
    "attention",  # out of tolerance
    "wear",  # tool worn
    "stop",  # probe fault, machine stopped
    "waiting",  # waits for a person or for the machine
    "correction",  # corrections and offsets
    "corrected",  # measured again after a correction
    "band-0",  # behind the readings, from the target outward
    "band-1",
    "band-2",
    "band-3",
    "band-4",
    "band-5",
]
BANDS: tuple[Role, ...] = ("band-0", "band-1", "band-2", "band-3", "band-4", "band-5")


@dataclass(frozen=True)
class Faded:
    """A role's colour as a veil, through which so much is seen."""

    role: Role
    share: float


Colour = Role | Faded
Palette = dict[Role, str]

PALETTES: dict[ThemeName, Palette] = {
    "light": {
        "surface": "#fbfbfa",
        "ink": "#1d2328",
        "quiet": "#5a646c",
        "faint": "#8d979e",
        "grid": "#dfe3e5",
        "steady": "#4a5560",
        "average": "#1d2328",
        "attention": "#a84b00",
        "wear": "#8a2a8c",
        "stop": "#c00f1e",
        "waiting": "#155fa8",
        "correction": "#155fa8",
        "corrected": "#1a7a3c",
        "band-0": "#fbfbfa",
        "band-1": "#f0f2f2",
        "band-2": "#e4e7e8",
        "band-3": "#f7efe6",
        "band-4": "#f3ebf4",
        "band-5": "#f8e9e9",
    },
    "dark": {
        "surface": "#1b2024",
        "ink": "#eceff1",
        "quiet": "#a7b1b8",
        "faint": "#6c777f",
        "grid": "#2c3338",
        "steady": "#b3bdc4",
        "average": "#ffffff",
        "attention": "#ffa94d",
        "wear": "#e08be2",
        "stop": "#ff6b6b",
        "waiting": "#74b6f2",
        "correction": "#74b6f2",
        "corrected": "#62c985",
        "band-0": "#1b2024",
        "band-1": "#22282d",
        "band-2": "#2b3238",
        "band-3": "#2e2820",
        "band-4": "#2b2330",
        "band-5": "#322224",
    },
}


def shown(colour: Colour, theme: ThemeName) -> str:
    """A colour as style sheets write it.

    >>> shown("wear", "light"), shown(Faded("wear", 0.14), "light")
    ('#8a2a8c', 'rgba(138,42,140,0.14)')
    """
    if not isinstance(colour, Faded):
        return PALETTES[theme][colour]
    solid = PALETTES[theme][colour.role]
    red, green, blue = (int(solid[at : at + 2], 16) for at in (1, 3, 5))
    return f"rgba({red},{green},{blue},{colour.share})"


ROLES = {colour: role for role, colour in reversed(PALETTES["light"].items())}


def followed(colour: str) -> str:
    """A colour of paper as a page writes it: by its name in `tokens.css`, which is another colour in the dark.

    >>> followed("#5a646c"), followed("rgba(138,42,140,0.14)"), followed("#ffffff")
    ('var(--quiet)', 'color-mix(in srgb, var(--wear) 14%, transparent)', 'var(--paper)')
    """
    if colour.startswith("rgba("):
        *parts, share = colour[5:-1].split(",")
        solid = "#" + "".join(f"{int(part):02x}" for part in parts)
        return f"color-mix(in srgb, {followed(solid)} {100 * float(share):g}%, transparent)"
    return f"var(--{ROLES[colour]})" if colour in ROLES else "var(--paper)"
