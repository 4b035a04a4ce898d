"""The bill of materials in CycloneDX 1.6: what is installed, whose it is, and what needs what."""

import uuid
from collections.abc import Mapping
from datetime import datetime
from typing import Any

from app.views.licences.libraries import Library

_SPDX = frozenset({"MIT", "MPL-2.0", "Apache-2.0", "BSD-2-Clause", "BSD-3-Clause", "PSF-2.0", "ISC", "LGPL-3.0-only"})


def bill(libraries: Mapping[str, Library], postgres: str | None, at: datetime) -> dict[str, Any]:
    """The document. postgres: the version of the PostgreSQL programs that Inband starts, None where there are none."""
    own = libraries["inband"]
    components = [_component(each) for each in libraries.values() if each is not own]
    if postgres is not None:
        components.append(_postgres(postgres))
    needs = {
        each.address: [libraries[name].address for name in each.needs if name in libraries]
        for each in libraries.values()
    }
    versions = " ".join(sorted(component["bom-ref"] for component in components))
    return {
        "bomFormat": "CycloneDX",
        "specVersion": "1.6",
        "serialNumber": uuid.uuid5(uuid.NAMESPACE_URL, f"{own.address} {versions}").urn,
        "version": 1,
        "metadata": {
            "timestamp": at.isoformat(timespec="seconds"),
            "component": {**_component(own), "type": "application"},
        },
        "components": components,
        "dependencies": [{"ref": ref, "dependsOn": sorted(needed)} for ref, needed in needs.items()],
    }


def _component(library: Library) -> dict[str, Any]:
    made: dict[str, Any] = {
        "type": "library",
        "bom-ref": library.address,
        "name": library.name,
        "version": library.version,
        "purl": library.address,
    }
    if library.summary:
        made["description"] = library.summary
    if library.licence:
        made["licenses"] = _licences(library.licence)
    if library.homepage:
        made["externalReferences"] = [{"type": "website", "url": library.homepage}]
    if parts := library.parts():
        made["components"] = [_part(each) for each in parts]
    return made


def _licences(said: str) -> list[dict[str, Any]]:
    if said in _SPDX:
        return [{"license": {"id": said}}]
    if any(word in said.split() for word in ("AND", "OR", "WITH")):
        return [{"expression": said}]
    return [{"license": {"name": said}}]


def _part(part: Mapping[str, Any]) -> dict[str, Any]:
    """A part that a wheel says it carries, without references, which are of its own document."""
    return {key: part[key] for key in ("type", "name", "version", "purl", "licenses") if key in part}


def _postgres(version: str) -> dict[str, Any]:
    return {
        "type": "application",
        "bom-ref": f"pkg:generic/postgresql@{version}",
        "name": "postgresql",
        "version": version,
        "purl": f"pkg:generic/postgresql@{version}",
        "cpe": f"cpe:2.3:a:postgresql:postgresql:{version}:*:*:*:*:*:*:*",
        "licenses": [{"license": {"id": "PostgreSQL"}}],
    }
