"""Soft shadows of closed meshes without noise: what a quad light loses to the surface between, as contours.

Seen from a point x, the silhouette of a closed surface bounds its layers. With w the number of layers before a
light point and f the integrand of the irradiance, int f w over the light is a sum of Lambert's edge terms: over
the silhouette edges inside the light, and along the light's rim as often as w says. Where layers overlap
(w > 1), int f (w - 1) is taken back, along those edges again: in strips of the light between their ends (`overlap`),
in which it is known which lies beside which (`order`).

Both parts are sums along lines that close, cut where they cross: exact but for rounding, of which every value carries
a bound.
"""

from __future__ import annotations

from .hidden import hidden_irradiance, shines_clear
from .shade import mesh_radiance, why_not

__all__ = ["hidden_irradiance", "mesh_radiance", "shines_clear", "why_not"]
