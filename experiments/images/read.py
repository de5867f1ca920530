"""Image files from the command line: which words are images, and what a file holds."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

import numpy as np

from nusselt.experiments.scenes import catalogue
from nusselt.renderer.errors import InputError
from nusselt.renderer.scene import Scene

from .formats import FORMATS, Raw
from .formats.npy import raw_of_array
from .formats.raw import check_bytes, refuse
from .transfer import RULES, Quantiser, Rule, Transfer

READERS = {kind.suffix: kind.read for kind in FORMATS}


def is_image(name: str) -> bool:
    """Whether a word on the command line names an image rather than a scene: by its ending."""
    return name not in catalogue.CLASSIC and Path(name).suffix.lower() in READERS


def read_image(name: str | PathLike[str], scene: Scene) -> Raw:
    """What an image file of a scene holds; memory is bounded by the scene's size.

    Raises
    ------
    InputError
        If it is damaged, of another size, or has no finite number in it.
    """
    path = Path(name)
    suffix = path.suffix.lower()
    if suffix not in READERS:
        raise refuse(path, suffix or "no ending", "an image that ends in " + ", ".join(READERS))
    check_bytes(path, (scene.width, scene.height))
    try:
        raw = READERS[suffix](path, scene.width, scene.height)
    except OSError as error:
        raise refuse(path, error.strerror or "unreadable", "a file that can be read") from error
    return _some_finite(path, raw)


def raw_of(image: object, scene: Scene, name: str) -> Raw:
    """The same of an array (h, w, 3), (h, w) or (3, h, w), called ``name``.

    Raises
    ------
    InputError
        If it is of another size or type, or has no finite number in it.
    """
    label = Path(name)
    try:
        values = np.asarray(image)
    except ValueError as error:
        raise refuse(label, type(image).__name__, "one array of numbers") from error
    return _some_finite(label, raw_of_array(label, values, scene.width, scene.height))


def _some_finite(path: Path, raw: Raw) -> Raw:
    if raw.values.dtype.kind == "f" and not np.isfinite(raw.values).any():
        raise refuse(path, "not one finite number", "an image")
    return raw


def quantiser_of(raws: list[Raw], transfer: str, rule: str) -> Quantiser:
    """How levels are to be read; the rule ``auto`` is the usual one of the curve until it is found out.

    Raises
    ------
    InputError
        If the images are not of one kind, or the names are unknown.
    """
    tops = {raw.levels for raw in raws}
    if len(tops) != 1:
        raise InputError("images", "of different depths", "images of one renderer, written alike")
    if rule not in (*RULES, "auto"):
        raise InputError("quantisation", rule, "one of " + ", ".join((*RULES, "auto")))
    if tops == {0} and (transfer, rule) != ("linear", "auto"):
        name, said = ("transfer", transfer) if transfer != "linear" else ("quantisation", rule)
        raise InputError(name, said, "it left out: these images hold radiance, no levels")
    curve = Transfer(transfer)
    usual: Rule = "truncate" if curve.name == "linear" else "round"
    return Quantiser(tops.pop(), curve, usual if rule == "auto" else rule)  # type: ignore[arg-type]
