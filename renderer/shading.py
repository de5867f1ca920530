"""Shading points and the light they reflect: Lambert plus modified Phong (Lafortune & Willems 1994)."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from nusselt.renderer.vectors import Ints

from .vectors import Floats, dot


@dataclass(frozen=True)
class ShadingPoints:
    """Points whose front the camera sees.

    Parameters
    ----------
    position, normal, outgoing, mirror : (3, n) float64
        Point; unit normal on the viewer's side; unit direction to the viewer; its mirror image.
    diffuse, specular : (3, n) float64
        Albedos.
    shininess : (n,) float64
        Phong exponents.
    ellipsoid : (n,) int64
        Ellipsoid on whose outside the point lies, so that nothing of it is above its horizon; -1 for none, and for
        points on the inside of one.
    outside : (n,) bool
        Whether it is known to lie on the front of one of the hierarchy's triangles (see `shadows`), with nothing of
        them around it: seen from beyond their bounding box.
    """

    position: Floats
    normal: Floats
    outgoing: Floats
    mirror: Floats
    diffuse: Floats
    specular: Floats
    shininess: Floats
    ellipsoid: Ints
    outside: NDArray[np.bool_]

    @property
    def count(self) -> int:
        return self.position.shape[1]

    @property
    def is_glossy(self) -> bool:
        return bool(self.specular.any())

    def take(self, index: Ints) -> ShadingPoints:
        """The points ``index`` (k,)."""
        return ShadingPoints(*(getattr(self, f.name)[..., index] for f in fields(self)))


def lobe(points: ShadingPoints, d: Floats, length: Floats) -> Floats:
    """(s+2)/(2 pi) max(r.w, 0)^s for directions d (3, n, k) of the given length (n, k); 1/sr.

    At s = 0 the power is 1 above the mirror direction's horizon and 0 below, and it is 0 exactly at a
    right angle for every s.
    """
    s = points.shininess[:, None]
    cosine = dot(points.mirror[:, :, None], d) / length
    with np.errstate(under="ignore"):
        power = np.where(cosine > 0, np.maximum(cosine, 0.0) ** s, 0.0)
    return (s + 2) / (2 * math.pi) * power


def reflect(points: ShadingPoints, d: Floats, weight: Floats, glossy: bool) -> Floats:
    """sum_k f(w_k, w_o) max(n.w_k, 0) weight_k / pi-free: the reflected radiance of a set of beams.

    Parameters
    ----------
    d : (3, n, k) float64
        Towards each light point, any length.
    weight : (n, k) float64
        Radiance times solid angle of each beam, without the surface's cosine.
    glossy : bool
        Whether the lobe is to be evaluated.

    Returns
    -------
    (3, n) float64
    """
    length = np.sqrt(dot(d, d))
    arriving = weight * np.maximum(dot(points.normal[:, :, None], d), 0) / length
    out = points.diffuse * (arriving.sum(axis=1) / math.pi)
    if glossy:
        out += points.specular * (arriving * lobe(points, d, length)).sum(axis=1)
    return out
