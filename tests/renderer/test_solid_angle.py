"""Directions uniform in solid angle: their density, their digits where lights are stiff, and what they are worth."""

from itertools import pairwise

import numpy as np
import pytest
from builders import box, floor, lamp, scene
from mpmath import mp, mpf
from scipy import stats

from nusselt.renderer.estimators import Area, Exact, SolidAngle
from nusselt.renderer.image import render
from nusselt.renderer.lights import DiskLight, QuadLight, SkyLight, TriangleLight
from nusselt.renderer.lights.sampling import unit_square
from nusselt.renderer.lights.spherical_fan import Outline, fan_beams
from nusselt.renderer.lights.spherical_rectangle import LARGE
from nusselt.renderer.surfaces import Material
from nusselt.renderer.vectors import cross, dot

FALSE_ALARM = 1e-6
WHITE = (1.0, 1.0, 1.0)
ORIGIN = np.zeros((3, 1))
CELLS, FINE = 9, 150


def square(corner, ab, ac):
    """Seen from the origin from before it, whichever way its edges turn."""
    return QuadLight(corner, *((ab, ac) if np.dot(np.cross(ab, ac), corner) > 0 else (ac, ab)), WHITE)


LIGHTS = {
    "square near": square((-0.5, -0.5, 0.05), (1, 0, 0), (0, 1, 0)),
    "square aside": square((0.5, 0.5, 0.3), (1, 0, 0), (0, 1, 0)),
    "sheared": square((0.3, -0.4, 1.0), (1.0, 0.2, 0.1), (-0.3, 1.2, 0.2)),
    "triangle near": TriangleLight((-0.5, -0.5, 0.1), (0.1, 0.9, 0.1), (1.0, -0.2, 0.1), WHITE),
    "triangle far": TriangleLight((2.0, 1.0, 3.0), (2.1, 2.0, 3.0), (3.0, 1.2, 3.3), WHITE),
}


def area_coordinates(light, d):
    """s, t of places corner + s ab + t ac, from the ways (3, k) there."""
    corner, ab, ac = light.columns
    normal, to = cross(ab, ac), d - corner
    return (dot(cross(to, ac), normal) / dot(normal, normal), dot(cross(ab, to), normal) / dot(normal, normal))


def expected_shares(light):
    """Solid angles of CELLS x CELLS parts of s, t, by midpoints of the area measure."""
    s, t = ((w + 0.5) / (CELLS * FINE) for w in np.divmod(np.arange((CELLS * FINE) ** 2), CELLS * FINE))
    corner, ab, ac = light.columns
    whole = isinstance(light, QuadLight)
    inside = 1.0 if whole else 2 * np.where(np.abs(s + t - 1) < 1e-9, 0.5, s + t < 1)
    worth = light.worth(ORIGIN, (corner + s * ab + t * ac)[:, None])[0] * inside / s.size
    return worth.reshape(CELLS, FINE, CELLS, FINE).sum(axis=(1, 3))


def p_value(light, beams, u, v, expected):
    d, _ = beams(ORIGIN, u, v)
    s, t = area_coordinates(light, d[:, 0])
    counts, *_ = np.histogram2d(s, t, bins=CELLS, range=((0, 1), (0, 1)))
    assert counts.sum() == u.size
    shares = expected / expected.sum() * u.size
    used = shares > 5
    assert counts[shares == 0].sum() == 0
    return stats.chi2.sf(((counts - shares)[used] ** 2 / shares[used]).sum(), used.sum() - 1)


@pytest.mark.parametrize("stratified", [False, True])
@pytest.mark.parametrize("name", LIGHTS)
def test_equal_solid_angles_hold_equal_numbers(name, stratified):
    """And the weights are the solid angle; places uniform in area, or a u that is off by a tenth, are found."""
    light, k = LIGHTS[name], 90_000
    expected = expected_shares(light)
    u, v = unit_square(np.random.default_rng(21), 1, k, stratified)
    assert p_value(light, light.solid_beams, u, v, expected) > FALSE_ALARM
    assert p_value(light, light.solid_beams, u**1.1, v, expected) < FALSE_ALARM
    assert p_value(light, light.beams, u, v, expected) < FALSE_ALARM
    np.testing.assert_allclose(light.solid_beams(ORIGIN, u, v)[1].sum(), expected.sum(), rtol=1e-4)


def tiny(size):
    return TriangleLight((0.3, -0.2, 1.0), (0.3, -0.2 + size, 1.0 + 0.2 * size), (0.3 + size, -0.2, 1.0), WHITE)


STIFF = {
    "contact": (square((-0.5, -0.4, 1e-3), (1, 0, 0), (0.1, 1, 0)), 1e-9),
    "edge-on": (square((1, -0.4, 1e-12), (1, 0, 0), (0.1, 1, 0)), 1e-13),
    "a needle": (square((-0.5, -0.4, 1), (1, 0, 0), (1e-7, 1e-6, 0)), 1e-9),
    "tiny": (tiny(1e-6), 1e-8),
    "tiny and edge-on": (square((1.0001, 1, 1.0003), (3e-5, 3.001e-5, 3e-5), (-1e-4, 1e-4, 0)), 1e-6),
}


def product(a, b):
    return sum(x * y for x, y in zip(a, b, strict=True))


def unit_ray(v):
    length = mp.sqrt(product(v, v))
    return [x / length for x in v]


def triangle_angle(a, b, c):
    volume = (
        a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])
    )
    return 2 * mp.atan2(abs(volume), 1 + product(a, b) + product(b, c) + product(c, a))


def rays_of(light):
    """Unit ways to the corners, around, the fan's first, in many digits."""
    corner, ab, ac = ([mpf(float(x)) for x in side[:, 0]] for side in light.columns)
    far = [(1, 1)] if isinstance(light, QuadLight) else []
    return [
        unit_ray([p + s * x + t * y for p, x, y in zip(corner, ab, ac, strict=True)])
        for s, t in ((0, 0), (1, 0), *far, (0, 1))
    ]


@pytest.mark.parametrize("name", STIFF)
def test_stiff_lights_keep_their_digits(name):
    """The beam at (u, 1) ends on the rim and cuts u of the solid angle off; along its arc 1 - cos is v of that at 1."""
    light, off = STIFF[name]
    u, v = np.random.default_rng(22).uniform(0.05, 0.95, (2, 1, 12))
    ends, inside = (light.solid_beams(ORIGIN, u, w) for w in (np.ones_like(v), v))
    assert np.ptp(ends[1]) == 0  # not sampled in area
    with mp.workdps(50):
        first, *rim = rays_of(light)
        angles = [triangle_angle(a, first, c) for a, c in pairwise(rim)]
        whole = sum(angles)
        assert abs(mpf(float(ends[1].sum())) / whole - 1) < 1e-11
        for k in range(u.size):
            end, way = (unit_ray([mpf(float(x)) for x in d[:, 0, k]]) for d in (ends[0], inside[0]))
            ahead, part = mpf(float(u[0, k])) * whole, 0
            while part + 1 < len(angles) and ahead > angles[part]:
                ahead, part = ahead - angles[part], part + 1
            assert abs(triangle_angle(rim[part], first, end) - ahead) < off * whole
            shares = (1 - product(first, way)) / (1 - product(first, end))
            assert abs(shares - mpf(float(v[0, k]))) < off


def test_what_is_tiny_behind_or_in_the_lights_plane():
    u, v = np.random.default_rng(23).random((2, 1, 64))
    light = LIGHTS["square near"]
    for at, lit in (((0, 0, 0.05), False), ((3, 0, 0.05), False), ((0, 0, 0.1), False), ((1e8, 0, 0), True)):
        points = np.reshape(at, (3, 1)) + 0.0
        for ours, areas in zip(light.solid_beams(points, u, v), light.beams(points, u, v), strict=True):
            np.testing.assert_array_equal(ours, areas)
        assert light.solid_beams(points, u, v)[1].any() == lit


def cut(at, u, v):
    """Solid angle, and x, y of the place, that Ureña's map makes of (u, v), seen from a point (x, y, -h), in digits."""
    x0, y0, z = (-mpf(float(c)) for c in at)
    x1, y1 = x0 + 1, y0 + 1
    n = [-y0 / mp.hypot(z, y0), x1 / mp.hypot(z, x1), y1 / mp.hypot(z, y1), -x0 / mp.hypot(z, x0)]
    angles = [mp.acos(-a * b) for a, b in zip(n, n[1:] + n[:1], strict=True)]
    whole = sum(angles) - 2 * mp.pi
    angle = mpf(float(u)) * whole + 2 * mp.pi - angles[2] - angles[3]
    slope = (mp.cos(angle) * n[0] - n[2]) / mp.sin(angle)
    c = mp.sign(slope) / mp.sqrt(slope**2 + n[0] ** 2)
    x = -c * z / mp.sqrt(1 - c**2)
    distance = mp.hypot(x, z)
    low, high = y0 / mp.hypot(distance, y0), y1 / mp.hypot(distance, y1)
    h = low + mpf(float(v)) * (high - low)
    return whole, x, h * distance / mp.sqrt(1 - h**2)


def test_rectangles_keep_their_digits_and_leave_the_small_to_the_fan():
    """From before them, beside them, and nearly edge-on; along one side at a time, as the map says."""
    light, rng, seen = QuadLight((0, 0, 0), (1, 0, 0), (0, 1, 0), WHITE), np.random.default_rng(24), 0
    outline = Outline(*light.columns, four=True)
    with mp.workdps(50):
        for height in np.geomspace(1e-9, 40, 60):
            points = np.array([*rng.uniform(-1, 2, 2) * max(1, height), -height])[:, None]
            u, v = rng.random((2, 1, 2))
            d, weight = light.solid_beams(points, u, v)
            for k in range(2):
                whole, x, y = cut((*points[:2, 0], height), u[0, k], v[0, k])
                if whole < 1.0001 * LARGE:
                    fan = fan_beams(outline, points, u, v, light.beams(points, u, v))
                    np.testing.assert_array_equal(d, fan[0])
                    continue
                seen += 1
                assert abs(mpf(float(weight[0, k])) * 2 / whole - 1) < 1e-11
                assert abs(mpf(float(d[0, 0, k])) - x) + abs(mpf(float(d[1, 0, k])) - y) < 1e-9
    assert 40 < seen < 100


def test_strata_along_the_sides_are_quieter_than_wedges():
    """By a quarter and more in all: 0.75 was found for 16 strata, and the fan against itself is 1."""
    light, rng = square((-0.5, -0.5, 1), (1, 0, 0), (0, 1, 0)), np.random.default_rng(25)
    points = np.vstack((rng.uniform(-2, 2, (2, 200)), rng.uniform(-1, 0.5, (1, 200))))
    outline = Outline(*light.columns, four=True)

    def noise(beams):
        sums = []
        for _ in range(60):
            d, weight = beams(*unit_square(rng, points.shape[1], 16, True))
            sums.append((weight * np.maximum(d[2], 0) / np.sqrt(dot(d, d))).sum(axis=1))
        return np.var(sums, axis=0, ddof=1).sum()

    ours = noise(lambda u, v: light.solid_beams(points, u, v))
    fan = noise(lambda u, v: fan_beams(outline, points, u, v, light.beams(points, u, v)))
    assert ours < 0.9 * fan


@pytest.mark.parametrize("light", [DiskLight((0, 1, 0), (0, -1, 0), 0.4, WHITE), SkyLight(WHITE)])
def test_other_kinds_are_sampled_as_by_area(light):
    made = scene(floor(), box((-0.6, 0.1, -0.4), (-0.1, 0.5, 0.1)), lights=(light,), size=(16, 12))
    images = [render(made, kind(samples=4, stratified=True), seed=1) for kind in (Area, SolidAngle)]
    np.testing.assert_array_equal(images[0].mean, images[1].mean)


@pytest.mark.parametrize("shiny", [False, True])
def test_right_behind_blockers_and_quieter_near_a_light(shiny):
    """Against the exact estimator, 0.05 below a lamp with a board between, at the level 1e-6."""
    material = Material((0.5, 0.4, 0.3), (0.3, 0.3, 0.3), 20.0) if shiny else Material((0.5, 0.4, 0.3))
    board = box((-0.7, 0.001, -0.2), (-0.2, 0.003, 0.2), material)
    light = TriangleLight((-0.9, 0.06, -0.3), (0.8, 0.3, -0.2), (0.1, 0.05, 0.6), WHITE)
    made = scene(floor(material=material), board, lights=(lamp(0.05), light), size=(32, 24))
    truth = render(made, Exact()).mean
    area, solid = (render(made, kind(samples=16, stratified=True), seed=5, passes=16) for kind in (Area, SolidAngle))
    lit = solid.shaded
    error, variance = (solid.mean - truth).mean(axis=0)[lit].sum(), solid.pixel_variance[lit].sum()
    assert 2 * stats.norm.sf(abs(error) / np.sqrt(variance / 16)) > FALSE_ALARM
    assert area.pixel_variance[lit].sum() > 20 * variance
