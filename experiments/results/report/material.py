"""What lies in a folder of results: rows, their images, and other figures. Nothing outside it is read."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from nusselt.experiments.results.document import read_json
from nusselt.experiments.results.rows import experiment_of
from nusselt.experiments.results.schema import Row
from nusselt.renderer.errors import InputError

DRAWN = (".svg", ".png")
"""Kinds of figure, the preferred one first."""


@dataclass(frozen=True)
class Material:
    """A folder of results.

    Parameters
    ----------
    folder : Path
    document : dict
        `results.json`.
    figures : tuple of Path
        Pictures that are no row's images, one a name.
    """

    folder: Path
    document: dict[str, Any]
    figures: tuple[Path, ...]

    @property
    def rows(self) -> list[Row]:
        rows: list[Row] = self.document["rows"]
        return rows

    def image(self, row: Row, name: str) -> Path | None:
        """A row's image by its name in the row, such as "ours_exr"; None where it is not in the folder.

        What somebody brought stands in the place of ours.
        """
        images = row.get("images")
        if not isinstance(images, dict):
            return None
        told = images.get(name, images.get(name.replace("ours", "brought")))
        return inside(self.folder, told) if isinstance(told, str) else None

    def figures_of(self, experiment: str) -> list[Path]:
        """Figures in a folder named after the experiment, or whose name starts with its name."""
        return [path for path in self.figures if self._owner(path) == experiment]

    def stray_figures(self) -> list[Path]:
        """Figures of no experiment that has rows."""
        return [path for path in self.figures if self._owner(path) is None]

    def _owner(self, path: Path) -> str | None:
        start = "-".join(path.relative_to(self.folder).parts)
        owners = {name for name in map(experiment_of, self.rows) if start.startswith(name)}
        return max(owners, key=len, default=None)


def inside(folder: Path, name: str) -> Path | None:
    """A file of the folder; None where there is none, or the name leads out of it."""
    path = (folder / name).resolve()
    return path if path.is_relative_to(folder.resolve()) and path.is_file() else None


def read_material(folder: Path) -> Material:
    """Look through a folder of results.

    Raises
    ------
    InputError
        If it holds no readable `results.json`.
    """
    if not folder.is_dir():
        raise InputError("folder", str(folder), "a folder with results.json, as --out makes it")
    document = read_json(folder / "results.json")
    taken: set[Path] = set()
    for row in document["rows"]:
        images = row.get("images")
        for name in images.values() if isinstance(images, dict) else ():
            if isinstance(name, str):
                taken.add(folder / name)
    return Material(folder, document, tuple(_figures(folder, taken)))


def _figures(folder: Path, taken: set[Path]) -> list[Path]:
    found: dict[Path, Path] = {}
    for ending in DRAWN:
        for path in sorted(folder.rglob(f"*{ending}")):
            free = path not in taken and not path.name.startswith(".")
            if free and inside(folder, str(path.relative_to(folder))):
                found.setdefault(path.with_suffix(""), path)
    return sorted(found.values())
