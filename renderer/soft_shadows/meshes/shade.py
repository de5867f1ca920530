"""Light of a quad behind closed meshes: the closed form minus what they hide."""

from __future__ import annotations

import math

import numpy as np

from nusselt.renderer.closed_forms.irradiance import irradiance
from nusselt.renderer.lights import colour
from nusselt.renderer.lights.facing import faced_by
from nusselt.renderer.needs import Source
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.vectors import Floats
from nusselt.renderer.visibility.shared_points import outline_of

from .hidden import hidden_irradiance, shines_clear
from .rounding import EPS


def why_not(source: Source) -> str:
    """What keeps silhouettes from telling all of a light's shadows; empty if they do.

    They do where a quad's shadows are those of big closed meshes on diffuse surfaces, and of nothing else.
    """
    b = source.blockers
    if source.light.parallelogram() is None:
        return "it is no quad"
    if b.offset is not None:
        return "shadow rays are to start off the surface"
    if source.glossy:
        return "a surface is glossy"
    others = b.loose.size + b.ellipsoids.size + b.disks.size
    if others:
        return f"{others} other surfaces stand before it"
    found, reason = outline_of(b.geometry, b.hierarchy, source.light)
    if found is None:
        return f"its big mesh does not bound a body: {reason}"
    return "" if shines_clear(source) else "its big mesh reaches behind it"


def mesh_radiance(points: ShadingPoints, source: Source) -> tuple[Floats, Floats]:
    """Radiance that diffuse points reflect, and a bound of its error; for sources without a `why_not`.

    Returns
    -------
    radiance : (3, n) float64
    bound : (n,) float64
        Of its absolute error, in units of what it would be without the mesh: rounding, all of it. 1 where rounding
        decides on which side of a face the point is, and where an image's tolerance is known.
    """
    light = source.light.parallelogram()
    if light is None:
        raise TypeError("a quad light is needed")
    out, bound = np.zeros_like(points.position), np.zeros(points.count)
    if points.count == 0:
        return out, bound
    x, n = points.position, points.normal
    whole, relative = irradiance(x, n, light.corner, light.ab, light.ac, enough=points.enough)
    lit = np.flatnonzero((whole > 0) & faced_by(*light.columns, x))
    if lit.size:
        x, n, whole, relative = x[:, lit], n[:, lit], whole[lit], relative[lit]
        lost, error = hidden_irradiance(source, x, n, points.outside[lit], points.tolerance)
        # What is left lies between nothing and all of it: to cut it there takes nothing from the bound.
        left = np.clip(whole - lost, 0, whole)
        out[:, lit] = points.diffuse[:, lit] * (left / math.pi) * colour(light)
        bound[lit] = np.minimum(error / whole, 1) + relative + 4 * EPS
    return out, bound
