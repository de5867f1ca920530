"""Two integrals along an arc of a great circle that the Phong lobe's boundary form needs, for any real exponent.

With t = c cos(phi) the cosine of the angle to w, phi from the circle's point nearest to w, q^2 + c^2 = 1:

    J1 = integral of t^s dphi,    J2 = integral of (1 - t^s) / (1 - t^2) dphi,    1 - t^2 = q^2 + c^2 sin(phi)^2.

Gauss-Legendre, each panel with as many nodes as its ellipse of analyticity asks for: with M the integrand's largest
size on the ellipse of semi-axes h (r + 1/r)/2 and h (r - 1/r)/2 about a panel of half length h, K nodes err by at most
64/15 h M r^-2K / (1 - r^-2) (Trefethen, Approximation Theory and Practice, theorem 19.3). On the ellipse, a + ib from
the circle's nearest point, |cos|^s <= exp(s/2 (b^2 - k a^2)), k = (sin(A)/A)^2 / cosh(B)^2 at its extreme points.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cache
from typing import Any

import numpy as np

from nusselt.renderer.vectors import Floats

NODES = (6, 10, 14, 20, 28, 40)
"""Numbers of nodes to choose from."""
ELLIPSES = (1.4, 2.2, 3.5, 6.0, 12.0, 40.0)
"""Parameters r tried."""
CUTS = 5
"""How often a panel may be halved."""
GRADED = 30
"""How often one that ends where t = 0 may be: of its halves only one ends there."""
LEAST = 1e-3
"""Circles whose t stays below it are not halved further."""
LOW = 0.3
"""Below it t itself is taken instead of 1 - t^2, which has lost it."""
AT_ONCE = 16384
"""Values at once: their arrays fit into the cache."""
FULL, TAIL, FAR, FULL_LOW = range(4)
"""J2 as it stands; without its 1, relative to the peak; the same far from w, where t is small; as it stands there."""


@dataclass(frozen=True, eq=False)
class Panels:
    """Stretches [middle - half, middle + half] of phi, k of them, each array (k,).

    Parameters
    ----------
    owner : int
        Which arc a panel belongs to.
    middle, half : float
        middle >= 0, the integrand being even.
    q2, c : float
        q^2 and c.
    s, log_peak : float
        Exponent, and log(t^s) at the polygon's point nearest to w.
    weight1, weight2 : float
        What J1 and J2 are multiplied by: how much of their error counts.
    form : int
        FULL, TAIL or FAR.
    """

    owner: Any
    middle: Floats
    half: Floats
    q2: Floats
    c: Floats
    s: Floats
    log_peak: Floats
    weight1: Floats
    weight2: Floats
    form: Any

    def take(self, index: Any) -> Panels:
        """The panels at ``index``."""
        return Panels(*(getattr(self, f.name)[index] for f in fields(self)))

    def cut(self) -> Panels:
        """Each panel as two."""
        half = self.half / 2
        parts = [np.abs(self.middle - half), self.middle + half]
        both = [np.concatenate((getattr(self, f.name),) * 2) for f in fields(self)]
        names = [f.name for f in fields(self)]
        both[names.index("middle")], both[names.index("half")] = np.concatenate(parts), np.concatenate((half, half))
        return Panels(*both)


@cache
def _rule(nodes: int) -> tuple[Floats, Floats]:
    x, w = np.polynomial.legendre.leggauss(nodes)
    return x[:, None], w[:, None]


def moments(panels: Panels, count: int) -> tuple[Floats, Floats, Floats]:
    """J1, J2 and the quadrature's error weight1 dJ1 + weight2 dJ2, summed over the panels of each of ``count`` arcs.

    In the forms TAIL and FAR both are divided by the peak's t^s, and J2 is the integral of -t^s / (1 - t^2).
    """
    totals = np.zeros((3, count), panels.half.dtype)
    panels, asked, tolerance, rate = _cut_to_fit(panels)
    kind = np.searchsorted(np.array(NODES[:-1]), asked)
    error = tolerance * np.exp(np.minimum(rate * np.maximum(asked - NODES[-1], 0), 80))
    totals[2] += np.bincount(panels.owner, error, minlength=count)
    nearest = np.cos(np.maximum(panels.middle - panels.half, 0)) * panels.c
    low = (panels.form == FULL) & (nearest < LOW)
    form_of = np.where(low, FULL_LOW, panels.form)
    for form in (FULL, FULL_LOW, TAIL, FAR):
        for number, nodes in enumerate(NODES):
            here = np.flatnonzero((form_of == form) & (kind == number))
            for start in range(0, here.size, AT_ONCE // nodes):
                few = panels.take(here[start : start + AT_ONCE // nodes])
                for total, part in zip(totals, _sums(few, form, nodes), strict=False):
                    total += np.bincount(few.owner, part, minlength=count)
    return totals[0], totals[1], totals[2]


def _cut_to_fit(panels: Panels) -> tuple[Panels, Floats, Floats, Floats]:
    """Panels, halved as long as they ask for many nodes, and what `nodes_needed` says of them."""
    done: list[tuple[Any, ...]] = []
    for number in range(GRADED):
        asked, tolerance, rate = nodes_needed(panels)
        many = asked > NODES[-2]
        if number >= CUTS:
            ends = np.abs(np.pi / 2 - panels.middle - panels.half) < panels.half / 2
            many &= (asked == np.inf) & (panels.c > LEAST) & ends
        kept = np.flatnonzero(~many)
        done.append((panels.take(kept), asked[kept], tolerance[kept], rate[kept]))
        panels = panels.take(np.flatnonzero(many)).cut()
        if not panels.half.size:
            break
    done.append((panels, *nodes_needed(panels)))
    joined = Panels(*(np.concatenate([getattr(part[0], f.name) for part in done]) for f in fields(Panels)))
    asked, tolerance, rate = (np.concatenate([part[k] for part in done]) for k in (1, 2, 3))
    return joined, asked, tolerance, rate


def _sums(k: Panels, form: int, nodes: int) -> tuple[Floats, Floats]:
    """J1 and J2 over each panel."""
    x, w = _rule(nodes)
    x, w = x.astype(k.half.dtype), w.astype(k.half.dtype)
    eps = np.finfo(k.half.dtype).eps
    phi = k.half * x
    phi += k.middle
    sine = np.sin(phi)
    z = sine * sine
    z *= 1 - k.q2
    z += k.q2
    np.clip(z, np.finfo(z.dtype).tiny, 1 - eps, out=z)
    if form in (FAR, FULL_LOW):
        log = np.log(np.maximum(np.cos(phi) * k.c, 1e-30))  # t itself: 1 - z has lost it
        log *= k.s
    else:
        log = np.log1p(-z)
        log *= k.s / 2
    if form in (FULL, FULL_LOW):
        fall = np.expm1(log)
        power = fall + 1
        fall /= -z
    else:
        log -= k.log_peak
        power = np.exp(log)
        fall = power / -z
    power *= w
    fall *= w
    return k.half * power.sum(axis=0), k.half * fall.sum(axis=0)


def nodes_needed(k: Panels) -> tuple[Floats, Floats, Floats]:
    """Nodes that leave the error named second, and the logarithm by which each node fewer raises it."""
    eps = np.finfo(k.half.dtype).eps
    tail = k.form != FULL
    base = k.s * np.log(np.maximum(k.c, 1e-30)) - np.where(tail, k.log_peak, 0.0)
    near = np.maximum(k.middle - k.half, 0)
    z = np.maximum(k.q2 + k.c * k.c * np.sin(near) ** 2, 1e-30)
    largest = np.where(tail, 1 / z, np.minimum(k.s / 2, 1 / z))
    tolerance = eps / 4 * k.half * (k.weight1 + k.weight2 * largest) + 1e-300
    pole = np.arcsinh(np.sqrt(k.q2) / np.maximum(k.c, 1e-30))
    x, y = k.middle / k.half, pole / k.half
    pole_c = (np.sqrt((x - 1) ** 2 + y * y) + np.sqrt((x + 1) ** 2 + y * y)) / 2
    best, rate = np.full(k.half.shape, np.inf), np.ones(k.half.shape)
    cosine, sine = np.cos(k.middle), np.sin(k.middle)
    tangent = sine / np.maximum(cosine, 1e-30)
    there = base + k.s * np.log(np.maximum(cosine, 1e-30))
    for r in ELLIPSES:
        c, s = (r + 1 / r) / 2, (r - 1 / r) / 2
        a2, b2 = (k.middle + k.half * c) ** 2, (k.half * s) ** 2
        narrow = np.exp(-0.4 * a2 - b2)  # below (sin(A)/A)^2 / cosh(B)^2
        log_m = base + k.s / 2 * (b2 - narrow * (k.middle * s) ** 2 / (s * s + narrow * c * c))
        # Or from the tangent of log cos at the middle, which holds where t is small: fall C y + bulge (1 - y^2).
        least = cosine * (1 - (k.half * c) ** 2 / 2) - sine * k.half * c
        fall = k.s * tangent * k.half * c
        bulge = k.s / 2 * b2 * (1 + b2) / np.maximum(least, 1e-15) ** 2
        log_m2 = there + np.where(fall < 2 * bulge, bulge + fall * fall / np.maximum(4 * bulge, 1e-30), fall)
        log_m = np.where((least > 0) & (log_m2 < log_m), log_m2, log_m)
        # A whole exponent has no branch at t = 0: |cos| <= cosh(b), and |1 + t| >= 2/3 as far as 1.84.
        whole = (k.s == np.floor(k.s)) & (a2 >= (np.pi / 2) ** 2) & (a2 < 3.38) & (b2 < 0.25)
        # And |cos z| <= |z - pi/2| cosh(b), largest at the ellipse's far end.
        zero = base + k.s * np.log((np.abs(np.pi / 2 - k.middle) + k.half * c) * np.cosh(k.half * s))
        log_m = np.where(whole, np.minimum(base + k.s / 2 * b2, zero), log_m)
        m = np.exp(np.minimum(log_m, 600.0))
        gap = np.maximum(pole_c - c, 1e-6)
        # |sin x - sin y| >= 0.6 |x - y| here, 0.5 as far as 1.84, and twice: 1 - t^2 has two poles' factors.
        poles = np.where(whole, 0.25, 0.36) * (k.c * k.half * gap) ** 2
        inverse = np.where(tail, m / np.maximum(poles, 1e-30), (1.5 * k.s + 1) * np.maximum(m, 1))
        error = 64 / 15 / (1 - r**-2) * k.half * (k.weight1 * m + k.weight2 * inverse)
        fits = (
            ((a2 < (np.pi / 2) ** 2) | (k.s == 0) | whole) & (b2 < 4) & (~tail | (pole_c > 1.02 * c))
        )  # short of t = 0
        needed = np.where(fits, np.log(error / tolerance) / (2 * np.log(r)), np.inf)
        rate = np.where(needed < best, 2 * np.log(r), rate)
        best = np.minimum(best, needed)
    # Where t = 0 ends every ellipse: t^s too small to count (the rule errs by twice the integral), and the 1 of J2.
    cut = np.flatnonzero(best == np.inf)
    if cut.size:
        few, rest = k.take(cut), z[cut]
        top = np.exp(base[cut] + few.s * np.log(np.maximum(np.cos(near[cut]), 1e-30)))
        lost = 8 * few.half * top * (few.weight1 + few.weight2 / rest)
        smooth = _nodes_for_one(few, pole_c[cut], tolerance[cut])
        little = (few.s > 0) & (lost < eps * (few.weight1 + few.weight2 * largest[cut]))  # and added to the bound
        best[cut] = np.where(little, np.where(tail[cut], NODES[0], smooth), np.inf)
        tolerance[cut] += np.where(little, lost, 0)
    return best, tolerance, rate


def _nodes_for_one(k: Panels, pole_c: Floats, tolerance: Floats) -> Floats:
    """Nodes for the integral of 1 / (1 - t^2), smooth through t = 0."""
    best = np.full(k.half.shape, np.inf)
    for r in ELLIPSES:
        c, s = (r + 1 / r) / 2, (r - 1 / r) / 2
        gap = np.maximum(pole_c - c, 1e-6)
        # |sin x - sin y| >= 0.5 |x - y| up to 1.84, and twice.
        inverse = 1 / np.maximum(0.25 * (k.c * k.half * gap) ** 2, 1e-30)
        # Far from its poles, as on a circle that keeps away from w, it is below 2 / q^2.
        apart = 1 / np.maximum(k.q2 - (k.c * np.sinh(k.half * s)) ** 2, 1e-30)
        error = 64 / 15 / (1 - r**-2) * k.half * k.weight2 * np.minimum(inverse, apart)
        fits = (k.middle + k.half * c < 1.84) & (k.half * s < 1) & (pole_c > 1.02 * c)
        best = np.where(fits, np.minimum(best, np.log(error / tolerance) / (2 * np.log(r))), best)
    return best
