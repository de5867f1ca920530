"""Point, directional and sun lights as the limits of area lights, each with its order of convergence."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nusselt.renderer.closed_forms.irradiance import irradiance
from nusselt.renderer.closed_forms.phong_lobe import phong_lobe
from nusselt.renderer.lights import SunLight
from nusselt.renderer.vectors import column, cross, dot, frame, unit

pytestmark = pytest.mark.mitsuba

NORMAL = unit(column((0.2, -0.3, 1.0)))
MIRROR = unit(column((0.4, 0.1, 1.0)))
CENTRE = column((0.5, 0.25, 2.0))
SIDES = column((1.0, 0.25, -0.5)), column((-0.25, 1.0, 0.75))
SIZES = 2.0 ** -np.arange(2, 14)


def corner(size, centre=CENTRE, sides=SIDES):
    ab, ac = (size * v for v in sides)
    return centre - (ab + ac) / 2, ab, ac


def orders(errors):
    """Powers of the size with which an error falls, from one halving to the next."""
    return np.log2(errors[:-1] / errors[1:])


def at_a_point(s=None):
    """cos cos' t^s / R^2 for unit radiance times area."""
    d, r2 = unit(CENTRE), dot(CENTRE, CENTRE)
    area = cross(*SIDES)
    value = dot(NORMAL, d) * np.abs(dot(unit(area), d)) / r2
    return (value if s is None else value * dot(MIRROR, d) ** s)[0]


@pytest.mark.parametrize("s", [None, 0.0, 3.5, 40.0])
def test_a_shrinking_light_of_constant_power_tends_to_a_point_light_with_order_two(s):
    area = math.sqrt(dot(cross(*SIDES), cross(*SIDES))[0])
    values = []
    for size in SIZES:
        light = corner(size)
        if s is None:
            value, _ = irradiance(np.zeros((3, 1)), NORMAL, *light)
        else:
            value, _ = phong_lobe(np.zeros((3, 1)), NORMAL, MIRROR, s, *light)
        values.append(value[0] / (area * size * size))
    errors = np.abs(np.array(values) / at_a_point(s) - 1)
    assert orders(errors)[4:10] == pytest.approx(2, abs=0.05)
    assert errors[-1] < 1e-5


def test_a_receding_light_of_constant_solid_angle_times_radiance_tends_to_a_directional_light_with_order_two():
    errors = []
    for size in SIZES:
        light = corner(1.0, CENTRE / size)
        e, _ = irradiance(np.zeros((3, 1)), NORMAL, *light)
        facing, _ = irradiance(np.zeros((3, 1)), unit(CENTRE), *light)  # L times the solid angle, to order two
        errors.append(abs(e[0] / facing[0] / dot(NORMAL, unit(CENTRE))[0] - 1))
    assert orders(np.array(errors))[4:10] == pytest.approx(2, abs=0.05)
    assert errors[-1] < 1e-7


def test_the_sun_above_the_horizon_is_a_directional_light_whatever_its_size():
    for degrees in (0.01, 0.5, 10.0):
        sun = SunLight((0.3, 0.2, 1.0), (1, 1, 1), degrees)
        assert sun.irradiance_on(NORMAL)[0] == pytest.approx(dot(NORMAL, column(sun.direction))[0], rel=1e-14)


def test_the_sun_on_the_horizon_tends_to_nought_with_order_one():
    """Half the disk: 2/(3 pi) sin(alpha), to order three, of the irradiance facing it."""
    alphas = 0.4 * 2.0 ** -np.arange(8)
    suns = [SunLight((0.0, 0.0, 1.0), (1, 1, 1), math.degrees(2 * a)) for a in alphas]
    values = np.array([sun.irradiance_on(column((1.0, 0.0, 0.0)))[0] for sun in suns])
    assert values[-1] == pytest.approx(2 / (3 * math.pi) * alphas[-1], rel=1e-4)
    assert orders(values)[4:] == pytest.approx(1, abs=0.01)


def test_a_square_of_the_suns_solid_angle_tends_to_the_sun_with_order_two():
    errors = []
    d = unit(column((0.3, 0.2, 1.0)))
    u, v = frame(d)
    for alpha in 0.4 * 2.0 ** -np.arange(8):
        sun = SunLight(tuple(d[:, 0]), (1, 1, 1), math.degrees(2 * alpha))
        side = math.sqrt(math.pi) * math.sin(alpha)
        e, _ = irradiance(np.zeros((3, 1)), NORMAL, d - side * (u + v) / 2, side * u, side * v)
        errors.append(abs(e[0] / (math.pi * math.sin(alpha) ** 2) / sun.irradiance_on(NORMAL)[0] - 1))
    assert orders(np.array(errors))[3:] == pytest.approx(2, abs=0.05)
