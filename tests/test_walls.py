"""The wall that import-linter cannot draw: parts of the shop floor meet only through each other's queries and actions."""

import grimp

HOUSE = {  # not parts of the shop floor
    "cli",
    "core",
    "db",
    "errors",
    "formats",
    "main",
    "paper",
    "settings",
    "web",
    "__main__",
}
OPEN = {
    "queries",
    "actions",
    "wording",
    "figures",
    "chart",
    "charts",
}  # wording and figures are pure: values in, sentences and pictures out; chart and charts read what a figure draws
WORDS = {"app.people.callers"}  # who calls: a plain value that everybody may speak of
EDGE = {"api", "pages", "schemas", "figures"}  # these take no tables; what lies behind a door (readings/saving.py) may


def crossings(graph: grimp.ImportGraph) -> list[str]:
    found = []
    for importer in sorted(graph.find_descendants("app")):
        part, _, module = importer.removeprefix("app.").partition(".")
        if part in HOUSE:
            continue
        for imported in sorted(graph.find_modules_directly_imported_by(importer)):
            other, _, door = imported.removeprefix("app.").partition(".")
            if not imported.startswith("app.") or imported in WORDS or other in HOUSE | {part}:
                continue
            # Whole packages (`from app.people import queries` shows as app.people.queries) are their front doors.
            # A part with much to ask has several of a kind (control.signals_queries): they are as open as the first.
            if door.rpartition("_")[2] in OPEN or (door == "tables" and module.partition(".")[0] not in EDGE):
                continue
            found.append(f"{importer} imports {imported}")
    return found


def test_parts_meet_only_through_queries_and_actions() -> None:
    assert crossings(grimp.build_graph("app", cache_dir=None)) == []


def test_queries_of_every_name_never_write() -> None:
    # import-linter takes whole names only: it sees app.control.queries, not app.control.signals_queries.
    graph = grimp.build_graph("app", cache_dir=None)
    found = [
        f"{importer} imports {imported}"
        for importer in graph.modules
        if importer.endswith("_queries")
        for imported in graph.find_modules_directly_imported_by(importer)
        if imported.rpartition(".")[2].rpartition("_")[2] in {"actions", "api", "pages"}
    ]
    assert found == []


def test_a_hole_in_the_wall_is_seen() -> None:
    graph = grimp.ImportGraph()
    for module in (
        "app",
        "app.alarms",
        "app.alarms.api",
        "app.machines",
        "app.machines.queries",
        "app.machines.tables",
    ):
        graph.add_module(module)
    graph.add_import(importer="app.alarms.api", imported="app.machines.queries")
    assert crossings(graph) == []
    graph.add_import(importer="app.alarms.api", imported="app.machines.tables")
    assert crossings(graph) == ["app.alarms.api imports app.machines.tables"]
