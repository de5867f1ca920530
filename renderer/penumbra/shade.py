"""Light of a quad behind closed meshes: the closed form minus what they hide."""

from __future__ import annotations

import math

from ..common_visibility import CommonVisibility
from ..light_points import colour
from ..needs import Source
from ..scene import QuadLight
from ..shading import ShadingPoints
from ..unshadowed import quad_light
from ..vectors import Floats
from .hidden import hidden_irradiance, shines_clear


def bounds_alone(source: Source) -> bool:
    """Whether a quad's shadows are those of big closed meshes on diffuse surfaces, and of nothing else."""
    b = source.blockers
    if b.hierarchy is None or source.glossy or b.offset is not None or not isinstance(source.light, QuadLight):
        return False
    closed = CommonVisibility.of(source).outline is not None
    return closed and not b.loose.size and not b.ellipsoids.size and shines_clear(source)


def mesh_radiance(points: ShadingPoints, source: Source, finer: int = 1, merge: int = 1) -> Floats:
    """Radiance (3, n) that diffuse points reflect; for sources whose shadows `bounds_alone` tells.

    Where layers do not overlap it is exact to rounding. Where they do, edges that cross inside a strip of the light
    are left out: relative RMS 8e-7 over the scene `mesh` at 100,000 triangles, 7e-6 at 2,000.
    """
    light = source.light
    if not isinstance(light, QuadLight):
        raise TypeError("a quad light is needed")
    out = quad_light(points, light, source.glossy)
    if points.count == 0:
        return out
    lost = hidden_irradiance(source, points.position, points.normal, finer, merge)
    return out - points.diffuse * (lost / math.pi) * colour(light)
