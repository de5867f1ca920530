"""Soft shadows of closed meshes without noise: what a quad light loses to the surface between, as contours.

Seen from a point x, the silhouette of a closed surface bounds its layers. With w the number of layers before a
light point and f the integrand of the irradiance, int f w over the light is a sum of Lambert's edge terms: over
the silhouette edges inside the light, and along the light's rim as often as w says. Where layers overlap
(w > 1), int f (w - 1) is taken back in strips of the light between consecutive ends of edges.

The first part is exact to rounding. So is the second, but for edges that cross inside a strip and the lines by
which a strip is integrated: see `overlap`.
"""

from __future__ import annotations

from .hidden import hidden_irradiance, shines_clear
from .shade import bounds_alone, mesh_radiance, why_not

__all__ = ["bounds_alone", "hidden_irradiance", "mesh_radiance", "shines_clear", "why_not"]
