"""Boundary integrals over arcs: against forty digits, closed forms, each other; and each error against its bound."""

from __future__ import annotations

import numpy as np
import pytest

from nusselt.renderer.closed_forms import arc_lobe, lobe_edges
from nusselt.renderer.closed_forms.arc_lambert import lambert_arcs
from nusselt.renderer.closed_forms.arc_lobe import lobe_arcs
from nusselt.renderer.closed_forms.circles import panel_rules
from nusselt.renderer.closed_forms.circles.circles import CircleArcs, lambert_circles
from nusselt.renderer.closed_forms.circles.cones import Rounds, ellipsoids, spheres
from nusselt.renderer.closed_forms.circles.lobe import lobe_circles
from nusselt.renderer.closed_forms.irradiance import irradiance
from nusselt.renderer.closed_forms.phong_lobe import phong_lobe

EXPONENTS = np.array([0, 0.1, 0.3, 0.5, 1, 1.5, 2, 7.3, 20, 100, 1e3, 1e4, 1e6])
NORMAL = (0.28, 0.0, 0.96)

# Name, start, end, exponent, value by mpmath: w = (0.6, 0, 0.8).
GREAT = [
    ("past the farthest point and back, 170 degrees", (-0.9, 0.5, 0.1), (0.7, -0.75, 0.1), 2.0, 2.535138258716407364),
    ("the same without a power", (-0.9, 0.5, 0.1), (0.7, -0.75, 0.1), 0.0, 2.4987695230988228268),
    ("a root at the horizon", (0.9, 0.1, 0.4), (-0.8, 0.5, 0.3), 0.5, 1.1965237509972081984),
    ("along the horizon", (-0.8, 0.001, 0.6), (0.02, 1.0, -0.015), 0.1, -1.4927244890193323228),
    ("from the horizon", (-0.8, 0.0, 0.6), (0.3, 0.5, 0.6), 0.3, -0.85623691521672006151),
    ("a steep lobe, 1e-4 beside it", (0.6, -0.4, 0.8001), (0.6, 0.5, 0.8001), 1000000.0, -0.13954322436133768088),
    ("a steep lobe that ends in its peak", (0.6, 0.0, 0.8), (0.5, 0.5, 0.9), 10000.0, 0.0042481691915543133196),
    ("through w", (0.6, -0.4, 0.8), (0.6, 0.5, 0.8), 20.0, 0.18379790611572330252),
    ("nearly half a circle", (1.0, 0.2, 0.3), (-1.0, -0.198, -0.3), 1.5, 2.8457974740676809133),
    ("a millionth long", (0.5, 0.2, 0.9), (0.500001, 0.2, 0.9), 100.0, -2.3684553385903927271e-6),
    ("a long way off", (0.001, 0.0005, 0.002), (300.0, -900.0, 500.0), 7.3, 0.41384858707818048825),
]
# Name, (k1, k3, rho), first and last phi, w, exponent, value by mpmath; e1, e2, e3 along the axes.
CIRCLES = [
    ("sphere that touches the horizon", (0.0, 0.8, 0.6), (-3.0, 2.5), (-0.48, 0.64, 0.6), 0.5, 1.5710521735557701383),
    ("sphere, a step at the horizon", (0.0, 0.6, 0.8), (-1.0, 3.0), (-0.48, 0.64, 0.6), 0.0, 2.1479997113517098021),
    ("sphere, nearly whole", (0.0, 0.6, 0.8), (-3.0, 3.0), (-0.48, 0.64, 0.6), 1.5, 2.4209851940504773241),
    (
        "sphere, a steep lobe beside it",
        (0.0, 0.8, 0.6),
        (-2.0, 1.0),
        (0.6, 0.0001, 0.8),
        1000000.0,
        1.2221914126700674352,
    ),
    ("ellipsoid, a step at the horizon", (0.5, 0.3, 0.6), (-3.0, 2.0), (-0.48, 0.64, 0.6), 0.0, 1.6899603459935456758),
    ("ellipsoid, a root at the horizon", (0.5, 0.3, 0.6), (-2.0, 3.0), (-0.6, 0.0, 0.8), 0.3, 1.839703713289766763),
    (
        "ellipsoid, a steep lobe across it",
        (0.5, 0.3, 0.6),
        (-3.0, 3.0),
        (0.48, 0.64, 0.6),
        10000.0,
        4.1666511379948497463,
    ),
    (
        "ellipsoid, flat, its tip in the lobe",
        (0.7, 0.01, 0.69),
        (-3.1, 3.1),
        (0.6, 0.0, 0.8),
        20.0,
        2.7792814762998288834,
    ),
]


def columns(*vectors):
    return [np.array(v, dtype=float).reshape(3, 1) for v in vectors]


def units(rng, n):
    v = rng.normal(size=(3, n))
    return v / np.linalg.norm(v, axis=0)


def upper(v, n):
    """Mirror directions lie above the surface."""
    return np.where((v * n).sum(axis=0) < 0, -v, v)


@pytest.mark.parametrize(("name", "start", "end", "s", "value"), GREAT)
def test_hard_great_circle_arcs_against_forty_digits(name, start, end, s, value):
    share, bound = lobe_arcs(*columns(start, end, NORMAL, (0.6, 0, 0.8)), np.array([float(s)]))
    assert abs(share[0] - value) <= bound[0]
    assert bound[0] < 1e-10
    back, _ = lobe_arcs(*columns(end, start, NORMAL, (0.6, 0, 0.8)), np.array([float(s)]))
    assert abs(share[0] + back[0]) <= 2 * bound[0]


@pytest.mark.parametrize(("name", "cone", "ends", "w", "s", "value"), CIRCLES)
def test_hard_circle_arcs_against_forty_digits(name, cone, ends, w, s, value):
    made = Rounds(np.arange(1), *columns(*np.eye(3)), *(np.array([k]) for k in cone), cone[0] == 0)
    arcs = CircleArcs(made, *(np.array([phi]) for phi in ends))
    share, bound = lobe_circles(arcs, *columns(NORMAL, np.array(w) / np.linalg.norm(w)), np.array([s]))
    assert abs(share[0] - value) <= bound[0]
    assert bound[0] < 1e-10


def random_arcs(rng, n):
    """Ends, normals and mirror directions: any, short, beside w, along the lobe's horizon."""
    a, b, normal, w = (units(rng, n) for _ in range(4))
    w = upper(w, normal)
    tiny = 10 ** rng.uniform(-16, 0, n)
    kind = rng.integers(4, size=n)
    b = np.where(kind == 1, a + tiny * b, b)
    a = np.where(kind == 2, w + tiny * a, a)
    level = [v - (1 - tiny) * (v * w).sum(axis=0) * w for v in (a, b)]
    a, b = (np.where(kind == 3, flat, v) for flat, v in zip(level, (a, b), strict=True))
    return a * 10 ** rng.uniform(-1, 1, n), b * 10 ** rng.uniform(-1, 1, n), normal, w


@pytest.mark.parametrize("s", EXPONENTS)
def test_an_arc_is_the_sum_of_its_parts(s):
    """Cut anywhere: other cores, bands and numbers of nodes add up to the same."""
    rng = np.random.default_rng(int(s * 10))
    a, b, normal, w = random_arcs(rng, 2000)
    step = b - a
    cut = a + rng.uniform(0, 1, 2000) * step
    power = np.full(2000, s)
    whole, one, two = (lobe_arcs(*ends, normal, w, power) for ends in ((a, b), (a, cut), (cut, b)))
    # The cut itself is rounded: it may leave the arc's plane by eps of its size.
    size = np.sqrt(np.minimum((a * a).sum(axis=0), (b * b).sum(axis=0)))
    moved = 4 * np.finfo(float).eps * (np.abs(a).max(axis=0) + np.abs(b).max(axis=0)) / size
    away = np.sqrt(np.maximum(1 - (cut * w).sum(axis=0) ** 2 / (cut * cut).sum(axis=0), moved))
    slack = 10 * moved / np.sqrt((cut * cut).sum(axis=0)) * size * (1 + np.minimum(np.sqrt(s), 1 / away))
    assert (np.abs(whole[0] - one[0] - two[0]) <= whole[1] + one[1] + two[1] + slack).all()
    assert np.median(whole[1]) < 1e-12


@pytest.mark.parametrize("s", EXPONENTS)
def test_a_great_circle_is_a_circle_cone(s):
    """k1 = k3 = 0: two ways to one value, arcs up to half a circle."""
    rng = np.random.default_rng(1 + int(s * 10))
    n = 300
    x, normal, w = (units(rng, n) for _ in range(3))
    g = np.cross(x, units(rng, n), axis=0)
    g /= np.linalg.norm(g, axis=0)
    y = np.cross(g, x, axis=0)
    first = rng.uniform(-np.pi, np.pi, n)
    last = np.minimum(first + rng.uniform(0, 0.99 * np.pi, n), np.pi)
    cone = Rounds(np.arange(n), x, y, g, np.zeros(n), np.zeros(n), np.ones(n), True)
    start, end = (x * np.cos(phi) + y * np.sin(phi) for phi in (first, last))
    power = np.full(n, s)
    one, two = lobe_arcs(start, end, normal, w, power), lobe_circles(CircleArcs(cone, first, last), normal, w, power)
    # Ends given by phi and by vectors differ by rounding.
    away = np.sqrt(np.minimum(*(1 - (v * w).sum(axis=0) ** 2 for v in (start, end))))
    slack = 4 * np.finfo(float).eps * (2 + np.minimum(np.sqrt(s), 1 / away)) * 2
    assert (np.abs(one[0] - two[0]) <= one[1] + two[1] + slack).all()
    one, two = lambert_arcs(start, end, normal), lambert_circles(CircleArcs(cone, first, last), normal)
    assert (np.abs(one[0] - two[0]) <= one[1] + two[1] + 8 * np.finfo(float).eps).all()


def random_circles(rng, n, right):
    center = units(rng, n) * (1 + 10 ** rng.uniform(-2, 1, n))
    if right:
        cone = spheres(np.zeros((3, n)), np.arange(n), center, np.ones(n))
    else:
        inverse = np.linalg.inv(rng.normal(size=(n, 3, 3)) * 10 ** rng.uniform(-1, 0.5, (n, 3, 1)))
        reach = np.linalg.norm(np.einsum("qij,jq->iq", inverse, center), axis=0)
        cone = ellipsoids(np.zeros((3, n)), np.arange(n), center * np.maximum(1, 1.05 / reach), inverse)
    first = rng.uniform(-np.pi, np.pi, n)
    first[::5] = -np.pi
    last = np.minimum(first + 10 ** rng.uniform(-3, 1, n), np.pi)
    last[::5] = np.pi
    return cone, first, last


@pytest.mark.parametrize("right", [True, False])
@pytest.mark.parametrize("s", EXPONENTS)
def test_a_circle_arc_is_the_sum_of_its_parts(s, right):
    """Whole circles too; half of the lobes point at the arc, or along its plane of t = 0."""
    rng = np.random.default_rng(2 + int(s * 10) + right)
    n = 200
    cone, first, last = random_circles(rng, n, right)
    normal, w = units(rng, n), units(rng, n)
    at = cone.direction(rng.uniform(first, last))
    at /= np.linalg.norm(at, axis=0)
    w[:, 1::4] = (at + 10 ** rng.uniform(-12, 0, n) * w)[:, 1::4]
    w[:, 2::4] = (w - (w * at).sum(axis=0) * at)[:, 2::4]
    w = upper(w / np.linalg.norm(w, axis=0), normal)
    cut, power = first + rng.uniform(0, 1, n) * (last - first), np.full(n, s)
    whole, one, two = (
        lobe_circles(CircleArcs(cone, *ends), normal, w, power) for ends in ((first, last), (first, cut), (cut, last))
    )
    assert (np.abs(whole[0] - one[0] - two[0]) <= whole[1] + one[1] + two[1]).all()
    assert np.median(whole[1]) < 1e-11
    whole, one, two = (
        lambert_circles(CircleArcs(cone, *ends), normal) for ends in ((first, last), (first, cut), (cut, last))
    )
    assert (np.abs(whole[0] - one[0] - two[0]) <= whole[1] + one[1] + two[1]).all()
    assert np.median(whole[1]) < 1e-12


@pytest.mark.parametrize("right", [True, False])
def test_without_a_power_the_lobe_is_the_irradiance(right):
    """s = 0 above the lobe's horizon."""
    rng = np.random.default_rng(7)
    cone, first, last = random_circles(rng, 2000, right)
    w = cone.e3
    above = np.flatnonzero(cone.k3 > 0.2)
    arcs = CircleArcs(cone.take(above), first[above], last[above])
    normal = units(rng, above.size)
    lobe, bound = lobe_circles(arcs, normal, w[:, above], np.zeros(above.size))
    flat, other = lambert_circles(arcs, normal)
    assert above.size > 500
    assert (np.abs(lobe - flat) <= bound + other).all()


def lights(rng, n):
    """Parallelograms (3, n) as a point sees them, from a thousandth of a radian to half the sky; n, w and s."""
    size = 10 ** rng.uniform(-3, 1.5, n)
    ab, ac = rng.normal(size=(2, 3, n)) * size
    ac *= 10 ** rng.uniform(-1, 0, n)
    u, v = rng.uniform(-0.3, 1.3, (2, n))
    corner = units(rng, n) - u * ab - v * ac
    facing = (np.cross(ab, ac, axis=0) * corner).sum(axis=0) > 0
    ab, ac = np.where(facing, ab, ac), np.where(facing, ac, ab)
    normal, w = units(rng, n), units(rng, n)
    toward = corner + rng.random(n) * ab + rng.random(n) * ac + 10 ** rng.uniform(-6, 0, n) * w
    w = np.where(rng.random(n) < 0.5, toward / np.linalg.norm(toward, axis=0), w)
    return corner, ab, ac, normal, upper(w, normal), rng.choice(EXPONENTS, n)


def contour(kernel, corner, ab, ac, *lobe):
    """A kernel's sum over the edges of lights cut at the horizon of lobe[0], its bounds' sum, and what cutting costs.

    Corners and crossings are rounded before a kernel sees them: ends move by some eps of the largest corner.
    """
    v = np.stack((corner, corner + ab, corner + ab + ac, corner + ac), axis=1)
    whole = lobe_edges.Arcs(v, np.roll(v, -1, axis=1), np.ones(v.shape[1:], dtype=bool))
    arcs = lobe_edges._clip(whole, lobe[0])
    total, bound, moved = np.zeros((3, corner.shape[1]))
    largest = np.sqrt((v**2).sum(axis=0)).max(axis=0)
    for edge in range(5):
        k = np.flatnonzero(arcs.there[edge])
        share, error = kernel(arcs.a[:, edge, k], arcs.b[:, edge, k], *(v[..., k] for v in lobe))
        total[k] += share
        bound[k] += error
        ends = np.sqrt([(v[:, edge, k] ** 2).sum(axis=0) for v in (arcs.a, arcs.b)])
        moved[k] += 4 * np.finfo(float).eps * (largest[k] / ends).sum(axis=0)
    return total, bound, moved


def test_contours_of_whole_lights_against_closed_forms():
    """Nothing in the way: within 1e-9 of the value, or the bound says so."""
    corner, ab, ac, n, w, s = lights(np.random.default_rng(3), 4000)
    origin = np.zeros_like(corner)
    value, relative = irradiance(origin, n, corner, ab, ac)
    power, relative_power = phong_lobe(origin, n, w, s, corner, ab, ac)
    known = relative_power < 1e-9
    for (total, bound, moved), right, doubt, told in (
        (contour(lambert_arcs, corner, ab, ac, n), 2 * value, relative, value > 0),
        (contour(lobe_arcs, corner, ab, ac, n, w, s), (s + 2) * power, relative_power, known & (power > 0)),
    ):
        steep = 1 + np.sqrt(s) if doubt is relative_power else 1.0
        assert (np.abs(total - right) <= bound + doubt * right + steep * moved)[told].all()
        # That the bound says so is rare where the value is not small.
        plain = told & (right > 1e-3)
        assert plain.sum() > 1000
        assert (bound > 1e-9 * right)[plain].mean() < 0.002


def test_the_core_at_zero_alone_is_caught(monkeypatch):
    """The planted defect: arcs that pass the farthest point are not turned."""
    right = arc_lobe._parts

    def wrong(arcs):
        low, high, banded = right(arcs)
        passes = arcs.first < -np.pi
        return np.where(passes, arcs.last, low), np.where(passes, arcs.last, high), banded & ~passes

    corner, ab, ac, n, w, s = lights(np.random.default_rng(3), 4000)
    power, _ = phong_lobe(np.zeros_like(corner), n, w, s, corner, ab, ac)
    monkeypatch.setattr(arc_lobe, "_parts", wrong)
    total, _, _ = contour(lobe_arcs, corner, ab, ac, n, w, s)
    assert (np.abs(total - (s + 2) * power) > 1e-2).sum() > 10


def test_arcs_without_length_are_nothing():
    """Padding: equal ends, ends along one line, and no ends at all; opposite ends are told by the bound."""
    start = np.array([[1, 2, 3], [0, 0, 0], [1, 2, 3], [0, 0, 0], [1, 0, 0]], dtype=float).T
    end = np.array([[1, 2, 3], [0, 0, 0], [2, 4, 6], [1, 0, 0], [-1, 0, 0]], dtype=float).T
    n, w = (np.repeat(v, 5, axis=1) for v in columns((0, 0, 1), (0.6, 0, 0.8)))
    found = [lambert_arcs(start, end, n), *(lobe_arcs(start, end, n, w, np.full(5, s)) for s in (0, 0.5, 3.0, 1e6))]
    for share, bound in found:
        assert (share == 0).all()
        assert (bound[:4] < 1e-11).all()
        assert bound[4] > 1
    axes = (np.repeat(v, 5, axis=1) for v in columns(*np.eye(3)))
    cone = Rounds(np.arange(5), *axes, *np.full((3, 5), 0.6), False)
    share, bound = lobe_circles(CircleArcs(cone, np.ones(5), np.ones(5)), n, w, np.arange(5.0))
    assert (share == 0).all()
    assert (bound == 0).all()
    empty = np.empty((3, 0))
    assert all(v.size == 0 for v in (*lambert_arcs(empty, empty, empty), *lobe_arcs(*(empty,) * 4, np.empty(0))))


@pytest.mark.parametrize("s", [0.0, 0.1, 0.5, 1.0, 2.5, 7.3, 15.0])
def test_a_root_is_integrated_exactly(s):
    """The integral of y^s / (y + 2): within its error of 400 graded panels, and not let stand for a pole close by."""
    y = panel_rules.NODES
    total, error, stands = panel_rules.root(1 / (y + 2), np.zeros(1), np.array([s]))
    edges = np.r_[0.0, 2.0 ** np.arange(-400, 1)]
    x, weight = np.polynomial.legendre.leggauss(30)
    nodes = (edges[1:] + edges[:-1])[:, None] / 2 + np.diff(edges)[:, None] / 2 * x
    right = (np.diff(edges)[:, None] / 2 * weight * nodes**s / (nodes + 2)).sum()
    assert stands.all()
    assert abs(total[0] - right) <= error[0] + 4e-16
    assert not panel_rules.root(1 / (y + 0.01), np.zeros(1), np.array([s]))[2].any()
    assert not panel_rules.gauss(1 / (y + 0.01), np.zeros(1))[2].any()
