"""A scene against one of its twins, point by point."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.vectors import Floats, dot

from .casters import unanimous
from .judge import Seen, Values, seen, twin_values
from .motions import Motion, rounding
from .sensitivity import input_noise
from .twins import Copy

SAME = 1e-9
"""How far apart, relative to the coordinates, two hits may lie that are taken to be one."""


@dataclass(frozen=True, eq=False)
class Compared:
    """Outcome.

    Parameters
    ----------
    index : (k,) int64
        Points of the first scene that were compared.
    ratio : (k,) float64
        Largest difference of a channel over what is allowed; above 1 they disagree.
    difference : (k,) float64
        Relative to the first scene's unoccluded value.
    theirs : (3, k) float64
        What the twin says, in the first scene's units.
    unmatched : int
        Points where the twin's camera saw something else.
    """

    index: Any
    ratio: Floats
    difference: Floats
    theirs: Floats
    unmatched: int

    @property
    def wrong(self) -> Any:
        """Which of the compared points disagree."""
        return np.flatnonzero(self.ratio > 1)


def compare(one: Seen, mine: Values, copy: Copy, estimator: Any) -> Compared | None:
    """Hold a scene's values against its twin's at the twin's image of the same points.

    None where the twin was rounded far from the origin and is rendered near it: digits it lost there stand for zeros
    here, and what was one plane is two.
    """
    other = seen(copy.scene)
    if not copy.exact and other.anchor.any():
        return None
    motion, kept = _between(one, other, copy.motion)
    index, twin_index = _matched(one, other, motion)
    few, exact = _points(one.points.take(index), other.points.take(twin_index), motion, copy.exact and kept)
    chosen = estimator if copy.shortcuts else replace(estimator, shortcuts=False)
    free = [mine.free[k][:, index] * copy.factor if k in mine.free else 0.0 for k in copy.parents]
    theirs, off = twin_values(other, few, chosen, free, copy.everything)
    allowed = mine.allowed[:, index] * copy.factor + off
    difference = np.abs(mine.radiance[:, index] * copy.factor - theirs)
    suspicious = np.flatnonzero((difference > allowed).any(axis=0))
    if suspicious.size:
        excuse = _excuse(one, other, few.take(suspicious), motion, exact[suspicious])
        allowed[:, suspicious] += excuse
    ratio = np.where(difference > 0, difference / np.maximum(allowed, 1e-300), 0.0).max(axis=0)
    ratio = np.where(np.isfinite(difference).all(axis=0), ratio, np.inf)
    share = difference.max(axis=0) / (mine.size[index] * copy.factor)
    return Compared(index, ratio, share, theirs / copy.factor, one.points.count - index.size)


def _between(one: Seen, other: Seen, motion: Motion) -> tuple[Motion, bool]:
    """From the coordinates in which one scene is rendered to those of the other; whether that took no rounding.

    The anchors are summed without rounding: each may be a camera's coordinate that was rounded by itself, far from the
    origin, and a digit lost puts all points off the surfaces that they lie on.
    """
    terms = np.column_stack((motion.matrix * one.anchor, motion.shift, -other.anchor))
    shift = [math.fsum(row) for row in terms]
    lost = [math.fsum((*row, -total)) for row, total in zip(terms, shift, strict=True)]
    return Motion(motion.matrix, np.array(shift)), not any(lost)


def _matched(one: Seen, other: Seen, motion: Motion) -> tuple[Any, Any]:
    """Numbers of the points of either scene that the same pixel sees at the same place of the same surface."""
    theirs = other.pixel_of[:, ::-1] if motion.mirrors else other.pixel_of
    both = (one.pixel_of >= 0) & (theirs >= 0)
    index, twin = one.pixel_of[both], theirs[both]
    a, b = one.points.take(index), other.points.take(twin)
    image = motion.points(a.position)
    size = float(max(np.abs(image).max(initial=0), np.abs(b.position).max(initial=0)))
    size += max(other.size, one.size * motion.scale)
    near = np.abs(image - b.position).max(axis=0, initial=0) <= SAME * size
    near &= dot(motion.directions(a.normal), b.normal) > 1 - SAME
    near &= (a.diffuse == b.diffuse).all(axis=0) & (a.specular == b.specular).all(axis=0)
    near &= (a.shininess == b.shininess) & ((a.ellipsoid >= 0) == (b.ellipsoid >= 0))
    return index[near], twin[near]


def _points(a: ShadingPoints, b: ShadingPoints, motion: Motion, kept: bool) -> tuple[ShadingPoints, Any]:
    """The images of a's points, on b's surfaces; which of them took no rounding, (n,), if the surfaces took none.

    Where image or surface had to be rounded it may lie off the twin's surface by more than a hit ever does: it is
    brought back onto the plane of the twin's own hit.
    """
    turned, shift = motion.steps(a.position), motion.shift[:, None]
    image = turned + shift
    exact = (rounding(turned, shift) == 0).all(axis=0) & kept
    image = np.where(exact, image, image - b.normal * dot(b.normal, image - b.position))
    normal = np.where(exact, motion.directions(a.normal), b.normal)
    outgoing, mirror = motion.directions(a.outgoing), motion.directions(a.mirror)
    return replace(b, position=image, normal=normal, outgoing=outgoing, mirror=mirror), exact


def _excuse(one: Seen, other: Seen, points: ShadingPoints, motion: Motion, exact: Any) -> Floats:
    """What may differ beyond all bounds: by rounding of the twin's numbers, or on the very edge of a hard shadow."""
    size = max(other.size, one.size * motion.scale)
    lights = other.scene.lights
    noise = np.where(exact, 0.0, input_noise(points, other.geometry, lights, size))
    blur = np.where(exact, 1e-14, 1e-11) * size
    return noise + np.where(unanimous(other.geometry, points, lights, blur), 0.0, np.inf)
