"""Walls that import-linter cannot draw: rooms meet only through each other's queries and actions."""

import re
from pathlib import Path

import grimp

import app

WINGS = {"loop", "quality", "geometry", "views"}  # floors that hold several rooms
KITS = {
    "charts",
    "cli",
    "core",
    "db",
    "errors",
    "files",
    "jobs",
    "language",
    "logs",
    "main",
    "memory",
    "settings",
    "simulators",  # a control is simulated by the words of its kind of bridge
    "web",
    "__main__",
}
OPEN = {"queries", "actions", "wording", "kinds", "keys", "figures", "pictures", "places", "glance", "chart", "charts"}
"""Doors of a room. Wording and figures are pure: values in, sentences and pictures out."""
OPEN_TO_VIEWS = {"schemas", "confirmation", "verbs", "request", "reader", "outcomes", "answers", "records"}
"""A page that composes rooms takes their forms and answers as well."""
COMPOSING = ("views.", "quality.control_charts")
"""The rooms of such pages: a control chart is drawn of a baseline, its rules and their signals."""
EVERYBODY = {f"app.access.{name}" for name in ("callers", "deps", "devices", "identification", "screens", "sign_in")}
"""Who calls is a plain value that everybody may speak of; so is how people and devices show who they are."""
EDGE = {"api", "pages", "schemas", "figures"}
"""These take no tables; what lies behind a door (readings/saving.py) may."""


def room_of(module: str) -> tuple[str, str]:
    """The room that a module lies in, and the rest of its name."""
    floor, _, rest = module.removeprefix("app.").partition(".")
    if floor in WINGS:
        name, _, rest = rest.partition(".")
        return f"{floor}.{name}", rest
    return floor, rest


def crossings(graph: grimp.ImportGraph) -> list[str]:
    """Imports that go round the doors of a room."""
    return [
        f"{importer} imports {imported}"
        for importer in sorted(graph.find_descendants("app"))
        for imported in sorted(graph.find_modules_directly_imported_by(importer))
        if imported.startswith("app.") and not allowed(importer, imported)
    ]


def allowed(importer: str, imported: str) -> bool:
    """Tell if one module may import the other.

    The tables of the loop are shared by all that read them: one schema under one lock. Those of another room are joined by
    queries of a floor above alone. A room with much to ask has several doors of a kind (series_queries): they are as open
    as the first.
    """
    (room, module), (other, inner) = room_of(importer), room_of(imported)
    if room in KITS or other in KITS | {room} or imported in EVERYBODY:
        return True
    own = module.rpartition(".")[2].rpartition("_")[2]
    door = inner.rpartition(".")[2].rpartition("_")[2]
    if other == "loop.tables":
        return own not in EDGE or room == f"loop.{inner}"
    if door == "tables":
        return not {"queries", "keys"}.isdisjoint(module.split(".")) or module.endswith("_queries")
    return (
        door in OPEN
        or (room.startswith(COMPOSING) and door in OPEN_TO_VIEWS)
        or (door == "schemas" and other == "access")
    )


def graph_of_app() -> grimp.ImportGraph:
    return grimp.build_graph("app", cache_dir=None)


def test_rooms_meet_only_through_their_doors() -> None:
    assert crossings(graph_of_app()) == []


def test_queries_of_every_name_never_write_and_pages_are_for_the_wiring() -> None:
    # import-linter takes whole names only: it sees app.quality.baselines.queries, not series_queries beside it.
    wrong = []
    graph = graph_of_app()
    for importer in graph.modules:
        for imported in graph.find_modules_directly_imported_by(importer):
            kind = imported.rpartition(".")[2].rpartition("_")[2]
            if importer.endswith("_queries") and kind in {"actions", "api", "pages"}:
                wrong.append(f"{importer} imports {imported}")
            if kind == "pages" and importer != "app.main" and room_of(importer)[0] != room_of(imported)[0]:
                wrong.append(f"{importer} imports {imported}")
    assert wrong == []


def test_a_hole_in_the_wall_is_seen() -> None:
    graph = grimp.ImportGraph()
    for module in ("app", "app.loop.alarms.api", "app.loop.machines.queries", "app.loop.tables.machines"):
        graph.add_module(module)
    graph.add_import(importer="app.loop.alarms.api", imported="app.loop.machines.queries")
    assert crossings(graph) == []
    graph.add_import(importer="app.loop.alarms.api", imported="app.loop.tables.machines")
    assert crossings(graph) == ["app.loop.alarms.api imports app.loop.tables.machines"]


def test_the_map_names_every_room() -> None:
    """The docstring of `app` draws the floors; each room stands in it, and nothing else does."""
    drawn = set(re.findall(r"^    ( {0,4}\w+(?:\.py)?) ", app.__doc__ or "", flags=re.MULTILINE))
    here = Path(app.__file__).parent
    rooms = {path.name for path in here.iterdir() if path.name not in {"__init__.py", "__main__.py", "__pycache__"}}
    inner = {
        path.name for wing in WINGS for path in (here / wing).iterdir() if path.is_dir() and path.name != "__pycache__"
    }
    assert {name.strip() for name in drawn} == rooms | inner


def test_statements_that_write_name_their_columns() -> None:
    """The order of the columns is another one in a database that had them added one by one."""
    nameless = [
        f"{path}: {statement[0]}"
        for path in Path(app.__file__).parent.rglob("*.py")
        for statement in re.finditer(
            r"\b(?:INSERT INTO [\w.]+(?![\w.]|\s*\()|COPY \w+\s+FROM)", path.read_text(encoding="utf-8")
        )
    ]
    assert nameless == []
