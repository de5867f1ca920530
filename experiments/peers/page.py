"""A cross-check's page: one offline HTML file, and the images beside it."""

from __future__ import annotations

import base64
import io
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from nusselt.experiments.files import folder_name, replacing
from nusselt.experiments.images.formats.png import to_levels
from nusselt.experiments.images.write import write_image
from nusselt.experiments.results.figures import save
from nusselt.experiments.results.pictures import RANGE, colour_difference
from nusselt.experiments.results.report.offline import asset, template

from .clusters import headline
from .cross import Cross
from .entrant import Entrant
from .tables import departure_rows, without
from .times.measure import Times
from .times.rows import time_figure, time_rows
from .times.words import CAPTION, TIME_COLUMNS, time_cells

LEAST = 1e-4
"""Of the mean: a difference's colours never show less."""


def write_cross(folder: Path, crosses: Sequence[Cross], results: dict[str, Any], command: str) -> None:
    """Write cross.html, and each scene's images as EXR in a folder of its own."""
    for cross in crosses:
        place = folder / folder_name(cross.scene.name)
        write_image(place / "exact.exr", cross.arbiter.truths["centre"].reference.mean)
        if cross.times:
            save(time_figure(cross.scene.name, cross.times), place, "times")
        for entrant in cross.entrants:
            write_image(place / f"{folder_name(entrant.name)}.exr", entrant.images.mean(axis=0))
    with replacing(folder / "cross.html") as beside:
        beside.write_text(cross_html(crosses, results, command), encoding="utf-8")


def cross_html(crosses: Sequence[Cross], results: dict[str, Any], command: str) -> str:
    """The page as text."""
    findings = [cross.findings for cross in crosses]
    said = {word for one in findings for word in one.words.values()}
    entrants = {entrant.name: entrant for cross in crosses for entrant in cross.entrants}
    return template("cross.html").render(
        headline=headline(findings),
        tone="bad" if "differs" in said else "good" if said == {"agrees"} else "open",
        scenes=[_scene(cross) for cross in crosses],
        departures=departure_rows(crosses),
        missing=without(crosses),
        entrants=[_about(entrant) for entrant in entrants.values()],
        alpha=results["alpha"],
        written=results["seconds"]["written"],
        versions=results["versions"],
        command=command,
        style=asset("style.css"),
    )


def _about(entrant: Entrant) -> dict[str, Any]:
    told = {"name": entrant.name, "version": entrant.version, "rule": entrant.rule, "images": len(entrant.images)}
    return told | dict(entrant.about)


def _scene(cross: Cross) -> dict[str, Any]:
    names = [entrant.name for entrant in cross.entrants]
    return {
        "name": cross.scene.name,
        "said": cross.findings.said,
        "pixels": int(cross.arbiter.shaded.sum()),
        "arbiter": cross.arbiter.said,
        "rows": [
            {"name": name, "exact": cross.exact[name], "pairs": [cross.pairs.get((name, other)) for other in names]}
            for name in names
        ],
        "exact": _picture(to_levels(cross.arbiter.truths["centre"].reference.mean).transpose(1, 2, 0)),
        "times": None if cross.times is None else _times(cross.scene.name, cross.times),
        "shots": [_shot(cross, entrant) for entrant in cross.entrants],
    }


def _times(scene: str, times: Times) -> dict[str, Any]:
    """Table and figure of error against time."""
    stream = io.BytesIO()
    time_figure(scene, times).savefig(stream, dpi=110)
    rows = [time_cells(row) for row in time_rows(scene, times)]
    return {"columns": TIME_COLUMNS, "rows": rows, "caption": CAPTION, "figure": _address(stream.getvalue())}


def _shot(cross: Cross, entrant: Entrant) -> dict[str, Any]:
    """An image, and its difference from the exact one in colours that end where noise and method do."""
    arbiter = cross.arbiter
    side = arbiter.contestant(entrant)
    noise = float(side.side.grey_variance.mean()) / arbiter.scale**2
    most = max(RANGE * math.hypot(math.sqrt(noise), side.rms_slack), LEAST)
    relative = np.where(arbiter.shaded, arbiter.residual(entrant).mean(axis=0), 0.0) / arbiter.scale
    return {
        "name": entrant.name,
        "image": _picture(to_levels(entrant.images[0]).transpose(1, 2, 0)),
        "difference": _picture(colour_difference(relative / most * RANGE)),
        "range": most,
    }


def _picture(levels: np.ndarray[Any, Any]) -> str:
    """A PNG as a data address, of eight bits (h, w, 3)."""
    from PIL import Image

    stream = io.BytesIO()
    Image.fromarray(np.asarray(levels, dtype=np.uint8)).save(stream, "PNG", optimize=True)
    return _address(stream.getvalue())


def _address(png: bytes) -> str:
    return "data:image/png;base64," + base64.b64encode(png).decode()
