"""What a parallelogram reflects where nothing is in the way, in closed form: Lambert plus the modified Phong lobe.

Reflected radiance = L [ kd/pi E + ks (s+2)/(2 pi) I(s) ], E the irradiance and I the lobe integral of the light's
polygon for unit radiance (`irradiance`, `phong_lobe`).
"""

from __future__ import annotations

import math

import numpy as np

from nusselt.renderer.closed_forms.irradiance import irradiance
from nusselt.renderer.closed_forms.phong_lobe import phong_lobe
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.vectors import Floats, Ints, dot

from .facing import faced_by


def quad_patch(points: ShadingPoints, corner: Floats, ab: Floats, ac: Floats, glossy: bool) -> tuple[Floats, Floats]:
    """Light of the parallelogram corner + u ab + v ac, one-sided, of unit radiance.

    Parameters
    ----------
    corner, ab, ac : (3, 1) or (3, n) float64
        Emits on the side of -(ab x ac).

    Returns
    -------
    radiance : (3, n) float64
        Reflected.
    bound : (n,) float64
        Of its relative error; what is below 1e-280 is nothing.
    """
    facing = faced_by(corner, ab, ac, points.position)
    heights = [dot(points.normal, v - points.position) for v in (corner, corner + ab, corner + ac, corner + ab + ac)]
    lit = np.flatnonzero(facing & (np.maximum.reduce(heights) > 0))  # the others are the dearest, and get nothing
    out, error = np.zeros_like(points.position), np.zeros_like(points.position)
    if lit.size:
        where = [_of(v, lit) for v in (corner, ab, ac)]
        value, bound = irradiance(points.position[:, lit], points.normal[:, lit], *where)
        out[:, lit] = points.diffuse[:, lit] * (value / math.pi)
        error[:, lit] = out[:, lit] * bound
    if glossy:
        shiny = np.flatnonzero((points.specular > 0).any(axis=0) & facing)
        if shiny.size:
            few = points.take(shiny)
            where = [_of(v, shiny) for v in (corner, ab, ac)]
            power, bound = phong_lobe(few.position, few.normal, few.mirror, few.shininess, *where)
            lobe = few.specular * ((few.shininess + 2) / (2 * math.pi) * power)
            out[:, shiny] += lobe
            error[:, shiny] += lobe * bound
    return out, np.divide(error, out, out=np.zeros_like(out), where=out > 1e-280).max(axis=0)


def _of(v: Floats, index: Ints) -> Floats:
    """The chosen columns of vectors that may be one for all."""
    return v if v.shape[1] == 1 else v[:, index]
