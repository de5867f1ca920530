"""Images small enough for one file, and still numbers: the value under the pointer is radiance, not a colour.

Each layer is normalised by a power of two and kept as float16 of as many bits as the page's detail has, its high bytes
before its low bytes, deflated, base64. Where that is too much, blocks of pixels are averaged, and the page says so.
"""

from __future__ import annotations

import base64
import hashlib
import math
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from nusselt.renderer.vectors import Floats


@dataclass(frozen=True)
class Detail:
    """How much of the images a page holds.

    Parameters
    ----------
    budget : int
        Bytes of all of them before base64, which adds a third.
    bits : int
        Of a value's mantissa: its relative error is 2^-(bits + 1).
    difference_bits : int
        The same of the difference in standard errors: it is noise, and incompressible.
    """

    budget: int
    bits: int
    difference_bits: int


BRIEF = Detail(1_900_000, 6, 3)
PRECISE = Detail(7_400_000, 10, 5)
COARSEST = 16
"""Largest side of a block; beyond it an image is left out."""


def averaged(layer: Floats, factor: int) -> Floats:
    """Means over blocks of factor x factor pixels of (c, h, w); what does not fill a block at the edge is averaged."""
    if factor == 1:
        return layer
    height, width = layer.shape[1:]
    rows, columns = np.arange(0, height, factor), np.arange(0, width, factor)
    total = np.add.reduceat(np.add.reduceat(layer, rows, axis=1), columns, axis=2)
    sizes = np.diff(np.append(rows, height))[:, None] * np.diff(np.append(columns, width))
    found: Floats = total / sizes
    return found


def averaged_difference(z: Floats, difference: Floats, factor: int) -> Floats:
    """The difference of block means in their standard errors, (1, h, w).

    Parameters
    ----------
    z, difference : (1, h, w) float64
        Pixel by pixel: in standard errors, and in radiance. A pixel's variance is the square of their ratio.
    """
    if factor == 1:
        return z
    variance = np.divide(difference, z, out=np.zeros_like(z), where=z != 0) ** 2
    error = np.sqrt(averaged(variance, factor)) / factor
    mean = averaged(difference, factor)
    return np.divide(mean, error, out=np.zeros_like(mean), where=error != 0)


def normaliser(layer: Floats) -> int:
    """The power of two that brings the largest finite value below 2^15, and no value further down than need be."""
    largest = float(np.abs(layer[np.isfinite(layer)]).max(initial=0.0))
    return math.frexp(largest)[1] - 15 if largest > 0 else 0


def encode(layer: Floats, exponent: int, bits: int = 10) -> bytes:
    """A layer (c, h, w) over 2^exponent as float16 of ``bits`` bits of mantissa, bytes in planes, deflated."""
    half = np.ldexp(layer, -exponent).astype("<f2").view("<u2").astype(np.uint32)
    if bits < 10:
        drop = 10 - bits
        finite = (half & 0x7C00) != 0x7C00
        half = np.where(finite, (half + (1 << (drop - 1))) >> drop << drop, half)
    planes = np.concatenate(((half >> 8).ravel(), (half & 255).ravel())).astype(np.uint8)
    return zlib.compress(planes.tobytes(), 6)


@dataclass(frozen=True)
class Packed:
    """A row's images in one resolution: what the viewer needs to know, and blobs by the name of their content."""

    info: dict[str, Any]
    blobs: dict[str, bytes]

    @property
    def size(self) -> int:
        return sum(map(len, self.blobs.values()))


def pack(layers: dict[str, Floats], factor: int, detail: Detail = PRECISE) -> Packed:
    """Encode a row's images, blocks of factor x factor pixels averaged.

    Parameters
    ----------
    layers : dict
        "ours", "reference", "mistaken" (3, h, w) and "difference" (1, h, w); all but the first may be missing.
    factor : int
    detail : Detail
    """
    known, blobs = {}, {}
    for name, layer in _reduced(layers, factor).items():
        exponent = normaliser(layer)
        blob = encode(layer, exponent, detail.difference_bits if name == "difference" else detail.bits)
        content = "p" + hashlib.sha256(blob).hexdigest()[:16]
        known[name], blobs[content] = {"blob": content, "exponent": exponent}, blob
    height, width = layers["ours"].shape[1:]
    size = {"width": -(-width // factor), "height": -(-height // factor), "factor": factor, "of": [width, height]}
    size["error"] = 2.0 ** -(detail.bits + 1)
    return Packed({**size, "layers": known}, blobs)


def total_size(found: list[Packed | None]) -> int:
    """Bytes of all blobs; rows that share a reference share its bytes."""
    every = {name: len(blob) for packed in found if packed for name, blob in packed.blobs.items()}
    return sum(every.values())


def texts(found: Sequence[Packed | None]) -> dict[str, str]:
    """Every blob in base64, by its name."""
    blobs = {name: blob for packed in found if packed for name, blob in packed.blobs.items()}
    return {name: base64.b64encode(blob).decode() for name, blob in blobs.items()}


def pack_all(
    sources: Sequence[Callable[[], dict[str, Floats]] | None],
    detail: Detail,
    tell: Callable[[int, int], None] = lambda done, total: None,
) -> list[Packed | None]:
    """Encode every row's images so that all fit: the largest are made coarser until they do, at last left out.

    Parameters
    ----------
    sources : sequence of callable or None
        Each reads one row's layers; None where it has none.
    detail : Detail
    tell : callable
        Called with (rows done, rows in all).
    """
    found: list[Packed | None] = []
    for source in sources:
        found.append(pack(source(), 1, detail) if source else None)
        tell(len(found), len(sources))
    while total_size(found) > detail.budget:
        index = max(range(len(found)), key=lambda i: found[i].size if found[i] else -1)  # type: ignore[union-attr]
        largest, source = found[index], sources[index]
        factor = largest.info["factor"] + 1 if largest else COARSEST + 1
        found[index] = pack(source(), factor, detail) if source and factor <= COARSEST else None
    return found


def _reduced(layers: dict[str, Floats], factor: int) -> dict[str, Floats]:
    found = {name: averaged(layer, factor) for name, layer in layers.items() if name != "difference"}
    if "difference" in layers and "reference" in layers:
        step = (layers["ours"] - layers["reference"]).mean(axis=0, keepdims=True)
        found["difference"] = averaged_difference(layers["difference"], step, factor)
    return found
