"""Irradiance's boundary integral over arcs of great circles, with its error; and what all boundary integrals share.

Irradiance: 1/2 the integral of n . (u x du) over the contour, on a great circle half its angle times n . Gamma
(Lambert 1760; Arvo 1994, eq. 2). Lobe: (s + 2) I = the integral of {t+^s n + (w.n) (1 - t+^s)/(1 - t^2) w} . (u x du),
t = w . u (the double-axis moments of Arvo 1995, for a real exponent). With t+ = max(t, 0) the form has no
singularity but at -w, which lies below every receiver's horizon.

Every kernel gives (share, bound), both (k,): bound >= |error| of the share for exactly the numbers given, from
rounding and from quadrature. An arc without length has the share 0.

             great circles            circle cones (outlines of spheres and ellipsoids)
irradiance   `lambert_arcs`, here     `circles.circles.lambert_circles`
lobe         `arc_lobe.lobe_arcs`     `circles.lobe.lobe_circles`
"""

from __future__ import annotations

import numpy as np

from nusselt.renderer.vectors import Floats

from .arc_lobe import EPS, dot_into, no_plane, plane_of

ROUNDINGS = 12.0
"""Roundings of a term in units of eps theta |a| |b - a| / |a x b|, counted."""


def lambert_arcs(start: Floats, end: Floats, n: Floats) -> tuple[Floats, Floats]:
    """Twice the share of irradiance of great-circle arcs (3, k), n unit vectors (3, k), and its bound, (k,)."""
    normal, bound = plane_of(start, end)
    spare = np.empty_like(bound)
    share, sine = dot_into(n, normal, spare), dot_into(normal, normal, spare)
    np.sqrt(sine, out=sine)
    none = np.flatnonzero(sine == 0)
    sine[none] = 1.0
    turn = np.arctan2(sine, dot_into(start, end, spare))
    turn /= sine
    share *= turn
    bound *= turn
    bound *= ROUNDINGS * EPS
    bound[none] = no_plane(start[:, none], end[:, none])
    return share, bound
