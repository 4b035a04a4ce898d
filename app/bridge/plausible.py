"""Sizes of a file against the targets of their characteristics, for a preview: is it the right column, and the right unit?"""

from collections.abc import Iterable, Mapping
from typing import NamedTuple

from app.bridge.configuration import Configuration, Machine
from app.bridge.file_entries import Entry
from inband_client import AsyncClient, ProblemError


class Target(NamedTuple):
    """The size that is aimed at, and the distance from it beyond which nothing is believed (R36), mm."""

    size: float
    limit: float


class Unasked(Exception):
    """The server has not said the targets; the words say why."""


async def targets_of(configuration: Configuration, machine: Machine, keys: Iterable[str]) -> dict[str, Target]:
    """The targets of these characteristics at the server. Raises `Unasked`."""
    ca, found = configuration.server.ca, {}
    try:
        async with AsyncClient(configuration.server.url, machine.secret, verify=ca or True, patience=0.0) as client:
            for key in dict.fromkeys(keys):
                parameters = (await client.get(f"/characteristics/{key}"))["parameters"]
                found[key] = Target(parameters["target"], parameters["confidence_limit"])
    except ProblemError as error:
        raise Unasked(str(error)) from error
    return found


def far_off(entries: Iterable[Entry], targets: Mapping[str, Target]) -> list[str]:
    """A sentence on each characteristic of which every size is farther from its target than a part can be."""
    sizes: dict[str, list[tuple[int, float]]] = {}
    for entry in entries:
        if "measured" in entry.body:
            sizes.setdefault(entry.body["characteristic"], []).append((entry.line, entry.body["measured"]))
    return [
        f"{key}: every size lies more than {target.limit:g} mm (R36) from the target {target.size:g} mm, the first in line"
        f" {found[0][0]} with {found[0][1]:g} mm. The server would take each for a fault of the probe: is it the right"
        " characteristic and column, a size and no deviation, and the right unit?"
        for key, found in sizes.items()
        if (target := targets.get(key)) is not None
        and all(abs(size - target.size) > target.limit for _line, size in found)
    ]
