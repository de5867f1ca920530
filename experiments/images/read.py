"""Image files from the command line: which words are images, and what a file holds."""

from __future__ import annotations

import math
import os
from dataclasses import replace
from os import PathLike
from pathlib import Path

import numpy as np

from nusselt.renderer.errors import InputError, printable
from nusselt.renderer.scene import Scene

from .formats import FORMATS, Raw, Wanted
from .formats.npy import raw_of_array
from .formats.raw import OtherSize, check_bytes, refuse
from .kinds import kind_of, split_layer
from .transfer import RULES, Quantiser, Rule, Transfer

READERS = {kind.suffix: kind.read for kind in FORMATS}
PIXEL = {kind.suffix: kind.pixel for kind in FORMATS}

MOST = 1 << 26
"""Pixels of an image that no scene bounds."""


def is_image(name: str) -> bool:
    """Whether a word on the command line names an image rather than a scene: by its first bytes, else its ending."""
    path, _ = split_layer(name)
    return kind_of(path) != ""


def size_of(name: str) -> tuple[int, int]:
    """Width and height of an image file of any size, FILE or FILE:LAYER.

    Raises
    ------
    InputError
        If it is damaged, or is too large to be looked at.
    """
    try:
        read_image(name, Wanted(1, 1), MOST)
    except OtherSize as other:
        if math.prod(other.size) > MOST:
            raise refuse(Path(name), "x".join(map(str, other.size)) + " pixels", f"at most {MOST}") from other
        return other.size
    return 1, 1


def read_image(name: str | PathLike[str], scene: Scene | Wanted, most: int = 0) -> Raw:
    """What an image file of a scene holds, FILE or FILE:LAYER; memory is bounded by the scene's size.

    Parameters
    ----------
    scene : Scene or Wanted
        What has its width and height.
    most : int
        Pixels that the file may be large enough for, where it is not only the scene's.

    Raises
    ------
    InputError
        If it is damaged, of another kind or size, or has no finite number in it.
    """
    path, layer = split_layer(os.fspath(name))
    wanted = Wanted(scene.width, scene.height, layer)
    kind = kind_of(path)
    if path.is_file() and kind not in READERS:
        told = f"a {kind} file" if kind else path.suffix.lower() or "no ending"
        raise refuse(path, told, "an image that is one of " + ", ".join(READERS))
    check_bytes(path, (most, 1) if most else wanted.size, PIXEL.get(kind, 0))
    try:
        with np.errstate(all="ignore"):  # what is not finite is counted, not warned of
            raw = READERS[kind](path, wanted)
    except OSError as error:
        raise refuse(path, error.strerror or "unreadable", "a file that can be read") from error
    if path.suffix.lower() != kind:
        raw = replace(raw, notes=(f"it is read as {kind}, which its first bytes say it is", *raw.notes))
    return _some_finite(path, replace(raw, notes=tuple(map(printable, raw.notes)), encoding=printable(raw.encoding)))


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
    return _some_finite(label, raw_of_array(label, values, Wanted(scene.width, scene.height)))


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
