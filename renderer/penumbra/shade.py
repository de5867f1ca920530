"""Light of a quad behind closed meshes: the closed form minus what they hide."""

from __future__ import annotations

import math

from ..common_visibility import outline_of
from ..light_points import colour
from ..lights import QuadLight
from ..needs import Source
from ..shading import ShadingPoints
from ..unshadowed import quad_light
from ..vectors import Floats
from .hidden import hidden_irradiance, shines_clear


def why_not(source: Source) -> str:
    """What keeps silhouettes from telling all of a light's shadows; empty if they do."""
    b = source.blockers
    if not isinstance(source.light, QuadLight):
        return "it is no quad"
    if b.hierarchy is None:
        return "no big mesh stands before it"
    if b.offset is not None:
        return "shadow rays are to start off the surface"
    if source.glossy:
        return "a surface is glossy"
    if b.loose.size or b.ellipsoids.size:
        return f"{b.loose.size + b.ellipsoids.size} other surfaces stand before it"
    found, reason = outline_of(b.geometry, b.hierarchy, source.light)
    if found is None:
        return f"its big mesh does not bound a body: {reason}"
    return "" if shines_clear(source) else "its big mesh reaches behind it"


def bounds_alone(source: Source) -> bool:
    """Whether a quad's shadows are those of big closed meshes on diffuse surfaces, and of nothing else."""
    return not why_not(source)


def mesh_radiance(points: ShadingPoints, source: Source, finer: int = 1, merge: int = 1) -> Floats:
    """Radiance (3, n) that diffuse points reflect; for sources whose shadows `bounds_alone` tells.

    Where layers do not overlap it is exact to rounding. Where they do, edges that cross inside a strip of the light
    are left out: relative RMS 8e-7 over the scene `mesh` at 100,000 triangles, 7e-6 at 2,000.
    """
    light = source.light
    if not isinstance(light, QuadLight):
        raise TypeError("a quad light is needed")
    out, _ = quad_light(points, light, source.glossy)
    if points.count == 0:
        return out
    lost = hidden_irradiance(source, points.position, points.normal, finer, merge, points.outside)
    return out - points.diffuse * (lost / math.pi) * colour(light)
