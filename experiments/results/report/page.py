"""The report's page: everything it shows is put together here, and rendered with every name escaped."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from jinja2 import TemplateError

from nusselt.experiments.files import replacing
from nusselt.experiments.results.columns import COLUMNS
from nusselt.experiments.results.pictures import RANGE
from nusselt.experiments.results.rows import experiment_of, in_table, urgent_first
from nusselt.experiments.results.schema import Row
from nusselt.experiments.results.summary import counted, facts, headline, kicker
from nusselt.experiments.results.work_precision import curves, races
from nusselt.renderer.errors import InputError

from .entries import colours, entry, layers, tiles
from .figures import BUDGET as FIGURES
from .figures import drawings, fitting
from .material import Material, read_material
from .offline import scripted
from .pixels import BRIEF, PRECISE, Detail, Packed, pack_all, texts, total_size
from .plots import ErrorFigure, error_figure
from .tables import plain_table

RANGES = {"difference": RANGE, "tiles": RANGE}
"""Where the colours of each signed picture end."""
SCRIPTS = ("viewer.js", "table.js")
Progress = Callable[[str, int, int], None]


def write_report(
    folder: str | Path, output: str | Path, progress: Progress | None = None, precise: bool = False
) -> int:
    """Write one HTML file that shows a folder of results, and needs nothing else.

    Parameters
    ----------
    folder : path
        As ``--out`` makes it: `results.json` with images and figures beside it.
    output : path
        The file to write.
    progress : callable, optional
        Called with (what, done, in all).
    precise : bool
        Images in four times the bytes: to eleven bits, and fewer of their pixels averaged.

    Returns
    -------
    int
        Rows in it.

    Raises
    ------
    InputError
        If there is no readable `results.json`, or the file cannot be written.
    """
    material = read_material(Path(folder))
    try:
        page = report_html(material, progress or (lambda what, done, total: None), PRECISE if precise else BRIEF)
    except InputError:
        raise
    except (ArithmeticError, AttributeError, LookupError, TemplateError, TypeError, ValueError) as error:
        raise InputError("results", str(folder), f"rows as the commands write them ({error})") from error
    with replacing(Path(output)) as beside:
        beside.write_text(page, encoding="utf-8")
    return len(material.rows)


def report_html(material: Material, progress: Progress, detail: Detail = BRIEF) -> str:
    """The page as text."""
    return scripted("page.html", SCRIPTS, _content(material, progress, detail))


def _content(material: Material, progress: Progress, detail: Detail) -> dict[str, Any]:
    rows = material.rows
    judged = urgent_first([row for row in rows if in_table(row)])
    packed = _packs(material, judged, detail, partial(progress, "images"))
    files = fitting(list(material.figures), FIGURES + detail.budget - total_size(packed))  # what the images left
    packs = [found.info if found else None for found in packed]
    errors = _error_figures(rows, "errors")
    tone, said = headline(rows)
    by = counted(rows)
    return {
        "folder": material.folder.resolve().name,
        "kicker": kicker(rows),
        "head": material.document,
        "tone": tone,
        "headline": said,
        "facts": facts(material.document),
        "by": {"all": len(judged), "failing": by["failing"], "undecided": by["undecided"]},
        "rows": _entries(material, judged, packs, errors, partial(progress, "figures")),
        "errors": errors.values(),
        "columns": COLUMNS,
        "several": len({experiment_of(row) for row in judged}) > 1,
        "races": races(rows),
        "experiments": _experiments(material, files),
        "strays": drawings(material.stray_figures(), files),
        "blobs": texts(packed),
        "viewer": {"images": packs, "tiles": [tiles(row) for row in judged], "colours": colours(), "ranges": RANGES},
        "seeds": sorted({str(row["seed"]) for row in rows if row.get("seed") is not None and "brought" not in row}),
    }


def _packs(
    material: Material, rows: list[Row], detail: Detail, tell: Callable[[int, int], None]
) -> list[Packed | None]:
    sources = [partial(layers, material, row) if material.image(row, "ours_exr") else None for row in rows]
    return pack_all(sources, detail, tell)


def _entries(
    material: Material,
    rows: list[Row],
    packs: list[dict[str, Any] | None],
    errors: dict[str, ErrorFigure],
    tell: Callable[[int, int], None],
) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = []
    for row, packed in zip(rows, packs, strict=True):
        found.append(entry(material, row, len(found), packed, errors.get(str(row.get("scene")))))
        tell(len(found), len(rows))
    return found


def _experiments(material: Material, files: dict[Path, Path]) -> list[dict[str, Any]]:
    """Every experiment's other rows as a table, and its figures: error against time where it left none."""
    found: list[dict[str, Any]] = []
    for name in dict.fromkeys(experiment_of(row) for row in material.rows):
        shown = [row for row in material.rows if experiment_of(row) == name and not in_table(row)]
        figures = drawings(material.figures_of(name), files)
        if shown or figures["shown"] or figures["left_out"]:
            errors = {} if figures["shown"] else _error_figures(shown, f"x{len(found)}")
            found.append({"name": name, "table": plain_table(shown), "figures": figures, "errors": errors})
    return found


def _error_figures(rows: list[Row], name: str) -> dict[str, ErrorFigure]:
    """Error against samples and time, by scene."""
    scenes = dict.fromkeys(str(row["scene"]) for row in rows if row.get("scene"))
    drawn = {scene: error_figure(curves(rows, scene), f"{name}-{k}") for k, scene in enumerate(scenes)}
    return {scene: figure for scene, figure in drawn.items() if figure}
