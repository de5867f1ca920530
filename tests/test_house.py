"""The arrows between folders: one way, no circles, and Mitsuba in the child process alone."""

from __future__ import annotations

import ast
import re
import sys
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
FOLDERS = ("renderer", "mitsuba_bridge", "experiments")
"""From the ground up: a folder imports those before it."""
FRONT = "experiments.nusselt"
"""The package's own root: on top of everything."""
FLAT = 6
"""Files of `experiments` that stand in no room, at most."""


def read_modules() -> dict[str, tuple[Path, list[str]]]:
    """Dotted name of every module of the source: its file, and the package it stands in."""
    modules = {}
    for folder in FOLDERS:
        for path in (ROOT / folder).rglob("*.py"):
            parts = list(path.relative_to(ROOT).with_suffix("").parts)
            if parts[-1] == "__init__":
                parts.pop()
                modules[".".join(parts)] = (path, parts)
            else:
                modules[".".join(parts)] = (path, parts[:-1])
    return modules


def imported(text: str, package: list[str]) -> set[str]:
    """Every module that a source text imports, anywhere in it; "a.b" for `from a import b` too."""
    names = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) + 1 - node.level] if node.level else []
            origin = ".".join([*base, *([node.module] if node.module else [])])
            names |= {origin} | {f"{origin}.{alias.name}" for alias in node.names}
    return {name.removeprefix("nusselt.") for name in names}


MODULES = read_modules()
OUTSIDE = {name: imported(path.read_text(encoding="utf-8"), package) for name, (path, package) in MODULES.items()}
ARROWS = {
    name: {to for to in targets if to in MODULES and to != name and not (to + ".").startswith(name + ".")}
    for name, targets in OUTSIDE.items()
}
"""Imports within the source; a package's own `__init__` may gather its parts."""


def room(name: str) -> str:
    """The folder of a folder, or the flat file, that a module stands in."""
    return ".".join(name.split(".")[:2])


def circle(graph: dict[str, set[str]]) -> list[str]:
    """Some circle of arrows; empty if there is none."""
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


def between_rooms() -> dict[str, set[str]]:
    graph: dict[str, set[str]] = {}
    for name, targets in ARROWS.items():
        graph.setdefault(room(name), set()).update(room(to) for to in targets if room(to) != room(name))
    return {name: targets - set(FOLDERS) for name, targets in graph.items() if name not in FOLDERS}


def test_arrows_go_down():
    floors = {folder: floor for floor, folder in enumerate(FOLDERS)}
    up = [
        (name, to)
        for name, targets in ARROWS.items()
        for to in targets
        if floors[to.split(".")[0]] > floors[name.split(".")[0]]
    ]
    assert up == []
    assert [name for name, targets in ARROWS.items() if FRONT in targets] == []


def test_no_circles_of_files_or_of_rooms():
    assert circle(ARROWS) == []
    assert circle(between_rooms()) == []


def test_the_renderer_imports_numpy_alone():
    allowed = {"numpy", "renderer", "nusselt", *sys.stdlib_module_names}
    for name, targets in OUTSIDE.items():
        if name.split(".")[0] == "renderer":
            tops = {target.split(".")[0] for target in targets if target}
            assert tops <= allowed, name


def test_mitsuba_is_imported_in_its_own_process_alone():
    for name, targets in OUTSIDE.items():
        if not name.startswith("mitsuba_bridge.child."):
            assert not {target.split(".")[0] for target in targets} & {"mitsuba", "drjit"}, name


def test_experiments_are_rooms():
    flat = [path.name for path in (ROOT / "experiments").glob("*.py")]
    assert len(flat) <= FLAT, flat


def test_a_circle_and_a_wrong_arrow_are_seen():
    """The control: what these tests look at finds what it should."""
    assert imported("from ..a import b\nimport nusselt.renderer.c", ["x", "y"]) == {"x.a", "x.a.b", "renderer.c"}
    assert imported("def f():\n    from . import z", ["x"]) == {"x", "x.z"}
    assert circle({"a": {"b"}, "b": {"c"}, "c": {"a"}})
    assert circle({"a": {"b"}, "b": {"c"}, "c": set()}) == []


def test_links_between_pages_lead_somewhere():
    pages = [*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md")]
    links = [(page, link) for page in pages for link in re.findall(r"\]\(([^)#\s]+)", page.read_text(encoding="utf-8"))]
    here = [(page, link) for page, link in links if not link.startswith("https:")]
    assert len(here) > 10
    assert [f"{page.name}: {link}" for page, link in here if not (page.parent / link).exists()] == []
