"""One row of the report's table: what the template says of it."""

from __future__ import annotations

import base64
import io
from typing import Any

import numpy as np
from matplotlib import colormaps
from scipy import special

from nusselt.experiments.images.formats.exr import exr_planes
from nusselt.experiments.results.document import plain
from nusselt.experiments.results.rows import (
    detectable,
    experiment_of,
    figures,
    finds,
    method,
    number,
    status,
    subject,
    title,
    whose,
)
from nusselt.experiments.results.schema import Row
from nusselt.experiments.results.summary import against
from nusselt.experiments.results.work_precision import seconds_of
from nusselt.renderer.errors import InputError

from .material import Material
from .plots import ErrorFigure, p_histogram

LAYERS = ("ours", "reference", "mistaken", "difference")
"""Both sides, the reference with the mistake in it that was named, and the two sides' difference."""
THUMBNAIL = 112
"""Pixels of a row's small picture, across."""


def layers(material: Material, row: Row) -> dict[str, Any]:
    """A row's images, those of `LAYERS` that it has: (3, h, w), the difference (1, h, w) in standard errors.

    Raises
    ------
    InputError
        If they cannot be read, or are not of one size.
    """
    paths = {name: material.image(row, f"{name}_exr") for name in LAYERS}
    found = {name: exr_planes(path) for name, path in paths.items() if path}
    shapes = {layer.shape[1:] for layer in found.values()}
    if len(shapes) > 1:
        raise InputError("images", title(row), "images of one size")
    return found


def entry(
    material: Material, row: Row, index: int, packed: dict[str, Any] | None, errors: ErrorFigure | None
) -> dict[str, Any]:
    """What the template says of a row: the row, and what has been made of it."""
    scene = str(row.get("scene") or "")
    label = f"{row.get('estimator') or ''}{' stratified' if row.get('stratified') else ''}"
    return {
        "row": row,
        "name": title(row),
        "scene": scene,
        "subject": subject(row),
        "figures": figures(row) if experiment_of(row) != "check" and not row.get("tiles") else [],
        "experiment": experiment_of(row),
        "method": method(row),
        "status": status(row),
        "interval": _whisker(row),
        "seconds": seconds_of(row),
        "packed": packed,
        "thumbnail": _thumbnail(material, row),
        "histogram": p_histogram(row["tile_p"], f"h{index}") if row.get("tile_p") else None,
        "errors": errors.shown(label) if errors else None,
        "whose": whose(row),
        "against": against(row),
        "finds": finds(row),
        "detectable": detectable(row, 2),
    }


def _whisker(row: Row) -> dict[str, float] | None:
    """The interval of the bias in margins, for a drawing that ends at two of them."""
    margin, bias, interval = number(row.get("margin")), number(row.get("bias_relative")), row.get("bias_interval")
    if not margin or bias is None or not interval:
        return None
    low, middle, high = (min(max(value / margin, -2.0), 2.0) for value in (interval[0], bias, interval[1]))
    return {"low": low, "middle": middle, "high": high}


def _thumbnail(material: Material, row: Row) -> str | None:
    path = material.image(row, "ours_png")
    if path is None:
        return None
    from PIL import Image

    stream = io.BytesIO()
    with Image.open(path) as picture:
        small = picture.convert("RGB")
        small.thumbnail((THUMBNAIL, THUMBNAIL))
        small.save(stream, "JPEG", quality=82)
    return "data:image/jpeg;base64," + base64.b64encode(stream.getvalue()).decode()


def tiles(row: Row) -> dict[str, Any] | None:
    """Each tile's bias, p-value and signed standard errors, row by row; null where it has none."""
    if not row.get("tile_p") or not row.get("tiles"):
        return None
    bias, p = (np.array(row[name], dtype=float) for name in ("tiles", "tile_p"))
    z = np.sign(bias) * -special.ndtri(np.clip(p, 1e-300, 1) / 2)
    told: dict[str, Any] = plain({"bias": bias.ravel(), "p": p.ravel(), "z": z.ravel(), "side": len(p)})
    return told


def colours() -> str:
    """The difference's colours from -4 to +4 standard errors, 256 x RGB, base64."""
    shades = (255 * colormaps["RdBu_r"](np.linspace(0, 1, 256))[:, :3]).round().astype(np.uint8)
    return base64.b64encode(shades.tobytes()).decode()
