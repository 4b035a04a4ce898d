"""The page of licences and the bill of materials: all that is installed and needed, by its own metadata."""

import json
import tomllib
from datetime import UTC, datetime
from importlib.metadata import version
from typing import Any

import pytest
from packaging.requirements import Requirement

from app import HOUSE
from app.views.licences.libraries import libraries, plain
from app.views.licences.sbom import bill
from tests.servers import Server
from tests.shop import Person


@pytest.fixture(scope="module")
def made() -> dict[str, Any]:
    document: dict[str, Any] = json.loads(json.dumps(bill(libraries(), "18.4", datetime(2026, 11, 26, tzinfo=UTC))))
    return document


def test_everything_that_is_needed_is_there_and_nothing_of_development() -> None:
    found = libraries()
    wanted = map(Requirement, tomllib.loads((HOUSE / "pyproject.toml").read_text())["project"]["dependencies"])
    named = {plain(each.name) for each in wanted if each.marker is None or each.marker.evaluate()}
    assert named <= set(found)
    assert {"starlette", "psycopg-binary", "argon2-cffi-bindings", "inband"} <= set(found), "what is needed by those"
    assert not {"pytest", "ruff", "djlint", "playwright"} & set(found)
    assert all(version(each.name) == each.version for each in found.values())


def test_each_says_its_licence() -> None:
    assert [each.name for each in libraries().values() if not each.licence] == []
    assert libraries()["psycopg"].licence == "LGPL-3.0-only"
    assert "SIL" in libraries()["pymupdf-fonts"].licence
    assert all(len(each.licence) < 100 for each in libraries().values()), "a name, never the text"


def test_the_bill_holds_together(made: dict[str, Any]) -> None:
    assert (made["bomFormat"], made["specVersion"], made["version"]) == ("CycloneDX", "1.6", 1)
    own = made["metadata"]["component"]
    assert (own["name"], own["type"]) == ("inband", "application")
    references = [own["bom-ref"], *(each["bom-ref"] for each in made["components"])]
    assert len(set(references)) == len(references)
    for each in made["dependencies"]:
        assert {each["ref"], *each["dependsOn"]} <= set(references)
    (fastapi,) = [each for each in made["dependencies"] if each["ref"].startswith("pkg:pypi/fastapi@")]
    assert any(each.startswith("pkg:pypi/starlette@") for each in fastapi["dependsOn"])
    (postgres,) = [each for each in made["components"] if each["name"] == "postgresql"]
    assert postgres["cpe"].split(":")[3:6] == ["postgresql", "postgresql", "18.4"]
    for each in made["components"]:
        assert all(set(licence) <= {"license", "expression"} for licence in each["licenses"])
        assert all(part.keys() >= {"type", "name"} for part in each.get("components", ()))


def test_what_wheels_carry_of_others_is_in_it(made: dict[str, Any]) -> None:
    carried = {each["name"]: {part["name"] for part in each.get("components", ())} for each in made["components"]}
    assert "bitflags" in carried["pydantic-core"]
    assert all(name not in parts for name, parts in carried.items()), "a bill names its own wheel first"


def test_the_page_lists_them_and_leads_to_their_texts(server: Server, operator: Person) -> None:
    text = operator.open("/licences")
    for each in libraries().values():
        assert f'href="/licences/{each.name}"' in text
        assert each.version in text
    assert "GNU LESSER GENERAL PUBLIC LICENSE" in operator.open("/licences/psycopg")
    assert "PostgreSQL Global Development Group" in operator.open("/licences/postgresql")
    operator.open("/licences/nothing-of-the-kind", 404)
    assert 'href="/licences"' in operator.open("/account")
    assert server.client().get("/licences").status_code == 303, "versions are not for strangers"


@pytest.mark.parametrize("name", ["pyserial"])
def test_a_distribution_without_a_text_says_so(operator: Person, name: str) -> None:
    if name in libraries():
        assert "carries no text" in operator.open(f"/licences/{name}")
