"""Irradiance and Phong lobe against oracles of 25 digits, and the bounds they give of themselves."""

from __future__ import annotations

import inspect
import itertools
import json
from decimal import Decimal, localcontext

import numpy as np
import pytest
from places import ROOT

import nusselt.renderer.closed_forms.irradiance as irradiance_module
import nusselt.renderer.closed_forms.lambert_formula as lambert_module
from nusselt.renderer.closed_forms.irradiance import irradiance
from nusselt.renderer.closed_forms.lobe_edges import lobe_by_edges
from nusselt.renderer.closed_forms.lobe_fan import lobe_by_area
from nusselt.renderer.closed_forms.phong_lobe import phong_lobe
from nusselt.renderer.vectors import cross, dot, unit

FOLDER = ROOT / "experiments" / "studies" / "stability"
STIFF = json.loads((FOLDER / "oracles-stiff.json").read_text())
RANDOM = json.loads((FOLDER / "oracles-random.json").read_text())
EPS = 2.0**-52


def evaluated(cases, dtype=np.float64):
    """Values and bounds of one kind's cases."""
    x, n, p, e1, e2 = (np.array([case[k] for case in cases]).T for k in ("x", "n", "P", "e1", "e2"))
    if cases[0]["kind"] == "E":
        return irradiance(x, n, p, e1, e2, dtype)
    w, s = np.array([case["w"] for case in cases]).T, np.array([case["s"] for case in cases], dtype=float)
    return phong_lobe(x, n, w, s, p, e1, e2, dtype)


def relative_errors(values, cases):
    """|value / oracle - 1|, 0 / 0 counting as 0, without rounding the oracle to a float."""
    errors = []
    with localcontext() as context:
        context.prec = 40
        for value, case in zip(values, cases, strict=True):
            exact = Decimal(case["oracle"])
            difference = abs(Decimal(float(value)) - exact)
            errors.append(float(difference / exact) if exact else float(difference > 0))
    return np.array(errors)


def of_kind(cases, kind):
    return [case for case in cases if case["kind"] == kind]


def violated(values, bounds, cases):
    """Names of the cases whose error is above the bound claimed."""
    broken = relative_errors(values, cases) > bounds
    return [case["name"] for case, bad in zip(cases, broken, strict=True) if bad]


def test_the_stiff_set_is_as_large_as_promised():
    assert len(STIFF) >= 100
    assert len({case["name"] for case in STIFF}) == len(STIFF)
    assert {"E", "I"} == {case["kind"] for case in STIFF}
    assert max(case["s"] for case in of_kind(STIFF, "I")) == 1e6


@pytest.mark.parametrize("kind", ["E", "I"])
@pytest.mark.parametrize("cases", [STIFF, RANDOM], ids=["stiff", "random"])
def test_no_value_is_wrong_by_more_than_the_bound_it_came_with(cases, kind):
    cases = of_kind(cases, kind)
    for dtype in (np.float64, np.float32):
        values, bounds = evaluated(cases, dtype)
        assert np.isfinite(values).all()
        assert np.isfinite(bounds).all()
        assert violated(values, bounds, cases) == []


@pytest.mark.parametrize("kind", ["E", "I"])
def test_stiff_cases_are_right_to_1e_12(kind):
    cases = of_kind(STIFF, kind)
    values, bounds = evaluated(cases)
    errors = relative_errors(values, cases)
    in_range = np.array([not 0 < Decimal(case["oracle"]) < Decimal("1e-280") for case in cases])
    assert errors[in_range].max() <= 1e-12
    assert np.median(bounds / np.maximum(errors, EPS)) <= 1e3
    # A condition number that says otherwise has no say: the inputs are taken as exact.
    assert max(case["condition"] for case in cases) > 1e3


def test_random_stiff_irradiances():
    cases = of_kind(RANDOM, "E")
    values, bounds = evaluated(cases)
    errors = relative_errors(values, cases)
    seen = np.array([Decimal(case["oracle"]) > 0 for case in cases])
    assert seen.mean() > 0.3
    assert np.median(errors[seen]) <= 1e-13
    assert np.quantile(errors[seen], 0.95) <= 1e-12
    assert errors.max() <= 1e-12
    assert np.median(bounds[seen] / np.maximum(errors[seen], EPS)) <= 1e3
    assert np.mean(bounds <= 1e-6) >= 0.9


def test_random_stiff_lobes():
    cases = of_kind(RANDOM, "I")
    values, bounds = evaluated(cases)
    errors = relative_errors(values, cases)
    seen = np.array([Decimal(case["oracle"]) > Decimal("1e-280") for case in cases])
    assert seen.mean() > 0.2
    assert errors[seen].max() <= 1e-12
    assert np.median(bounds[seen] / np.maximum(errors[seen], EPS)) <= 1e3
    assert np.mean(bounds <= 1e-6) >= 0.9


@pytest.mark.parametrize("kind", ["E", "I"])
def test_float32_is_right_to_1e_4(kind):
    cases = [case for case in of_kind(STIFF + RANDOM, kind) if not 0 < Decimal(case["oracle"]) < Decimal("1e-30")]
    values, _ = evaluated(cases, np.float32)
    assert values.dtype == np.float32
    errors = relative_errors(values, cases)
    assert errors.max() <= 1e-4
    assert np.median(errors) <= 1e-6


def test_a_horizon_clip_that_drops_touching_edges_is_caught(monkeypatch):
    wrong = inspect.getsource(lambert_module.lambert).replace("za >= 0", "za > 0").replace("zb >= 0", "zb > 0")
    names = dict(vars(lambert_module))
    exec(compile("from __future__ import annotations\n" + wrong, "planted", "exec"), names)
    monkeypatch.setattr(irradiance_module, "lambert", names["lambert"])
    cases = of_kind(STIFF, "E")
    broken = violated(*evaluated(cases), cases)
    assert any("touches the horizon" in name for name in broken)


@pytest.mark.parametrize("kind", ["E", "I"])
@pytest.mark.parametrize("power", [-40, 3, 55])
def test_scaling_by_a_power_of_two_changes_no_bit(kind, power):
    cases = of_kind(RANDOM, kind)[:60]
    scaled = [{k: np.ldexp(v, power) if k in ("x", "P", "e1", "e2") else v for k, v in case.items()} for case in cases]
    for one, other in zip(evaluated(cases), evaluated(scaled), strict=True):
        assert (one == other).all()


def on_a_grid(seed, count):
    """Lights and points whose coordinates are multiples of 1/64: moving them by whole numbers is exact."""
    r = np.random.default_rng(seed)
    x, p, e1, e2 = (r.integers(-256, 256, (3, count)) / 64 for _ in range(4))
    n, w = r.normal(size=(2, 3, count))
    return x, n, w, r.uniform(0, 60, count), p, e1, e2


def test_moving_everything_by_whole_numbers_changes_little_or_nothing():
    x, n, w, s, p, e1, e2 = on_a_grid(3, 300)
    by = np.array([[1024.0], [-2048.0], [512.0]])
    for here, there in (
        (irradiance(x, n, p, e1, e2), irradiance(x + by, n, p + by, e1, e2)),
        (phong_lobe(x, n, w, s, p, e1, e2), phong_lobe(x + by, n, w, s, p + by, e1, e2)),
    ):
        # The scale is taken from all coordinates, so that roundings may differ, but by no more than the bounds.
        assert (np.abs(here[0] - there[0]) <= here[0] * here[1] + there[0] * there[1]).all()


def test_two_halves_of_a_light_add_up_to_the_whole():
    x, n, w, s, p, e1, e2 = on_a_grid(4, 300)
    for form in (lambda *q: irradiance(x, n, *q), lambda *q: phong_lobe(x, n, w, s, *q)):
        whole, first, second = form(p, e1, e2), form(p, e1 / 2, e2), form(p + e1 / 2, e1 / 2, e2)
        slack = sum(value * bound for value, bound in (whole, first, second))
        assert (np.abs(first[0] + second[0] - whole[0]) <= slack + 4 * EPS * whole[0] + 1e-280).all()
        assert (whole[0] > 0).mean() > 0.2


def test_the_order_of_a_lights_sides_does_not_matter():
    x, n, w, s, p, e1, e2 = on_a_grid(5, 300)
    one, other = phong_lobe(x, n, w, s, p, e1, e2), phong_lobe(x, n, w, s, p, e2, e1)
    assert (np.abs(one[0] - other[0]) <= one[0] * one[1] + other[0] * other[1]).all()


def test_a_lobe_of_exponent_nought_and_one_are_known_integrals():
    x, n, w, _, p, e1, e2 = on_a_grid(6, 300)
    both, bound = phong_lobe(x, n, n, 0.0, p, e1, e2)
    alone, other = irradiance(x, n, p, e1, e2)
    assert (np.abs(both - alone) <= both * bound + alone * other).all()
    # max(n.u) max(w.u) is symmetric.
    one, other_way = phong_lobe(x, n, w, 1.0, p, e1, e2), phong_lobe(x, w, n, 1.0, p, e1, e2)
    assert (np.abs(one[0] - other_way[0]) <= one[0] * one[1] + other_way[0] * other_way[1]).all()


def test_a_lobe_shrinks_as_its_exponent_grows():
    x, n, w, _, p, e1, e2 = on_a_grid(7, 300)
    values = np.array([phong_lobe(x, n, w, power, p, e1, e2)[0] for power in (0, 0.3, 1, 4, 20, 100, 1e3, 1e5)])
    assert (np.diff(values, axis=0) <= 1e-12 * values[:-1]).all()


def test_a_needle_whose_short_end_is_where_the_lobe_turns_loses_no_digits():
    """6e-13 once, six times its bound: an end of 1e-6 was measured by what is left of coordinates of 0.1.

    The value is a quadrature of the same numbers with 40 digits.
    """
    right = 6.810063236968154e-08
    vectors = [
        (0.01757266367226574, 0.0, 0.01086811283259096),
        (0.0, 1.0, 0.0),
        (0.11682080689234627, 0.8799363245128244, 0.46050511819075624),
        (0.02349751629791476, 0.04699503259582952, 0.01174875814895738),
        (0.0, 0.0, 1.174875814895738e-07),
        (0.02349751629791476, 0.0, 0.0),
    ]
    for axes in itertools.permutations(range(3)):
        x, n, w, corner, ab, ac = (np.array(v)[list(axes), None] for v in vectors)
        value, bound = phong_lobe(x, n, w, 20.0, corner, ab, ac)
        assert bound < 2e-13
        assert abs(value / right - 1) < bound


def test_both_forms_of_the_lobe_agree_where_its_horizon_cuts_the_light():
    """Boundary and area share no formula; exponents near 0, where all of the cut light counts, and whole ones."""
    rng = np.random.default_rng(5)
    n = 3000
    normals, mirror = unit(rng.normal(size=(3, n))), unit(rng.normal(size=(3, n)))
    corner = rng.normal(size=(3, n))
    corner += mirror * (10 ** rng.uniform(-4, 0, n) - dot(corner, mirror))
    ab, ac = (unit(rng.normal(size=(3, n))) * 10 ** rng.uniform(-1.5, 0.7, n) for _ in range(2))
    s = np.where(rng.random(n) < 0.5, rng.integers(0, 25, n), 10 ** rng.uniform(-4, 1.5, n)).astype(float)
    vectors = (corner, ab, ac, normals, mirror)
    by_edges, error = lobe_by_edges(*vectors, s, True)
    by_area, bound = lobe_by_area(np.zeros((3, n)), normals, mirror, s, corner, ab, ac)
    told = (by_area > 0) & (bound < 1e-10) & (error >= 0) & (error < 1e-10 * by_area)  # others are not let stand
    assert told.sum() > 1000
    off = np.abs(by_edges - by_area)[told]
    assert (off <= (error + bound * by_area)[told]).all()


@pytest.mark.parametrize("s", [0.0, 1e-3, 0.1, 0.3, 2.0])
def test_a_light_cut_by_both_horizons_near_where_they_meet(s):
    """A cut twice along one line has crossings of rounding errors: it once added 9 % to small exponents."""
    n, w, p, e1, e2 = (
        np.array(v)[:, None]
        for v in (
            (-0.2973858011038157, -0.9538827257577508, -0.040858668637212846),
            (-0.9303233416388359, 0.25758183526469575, -0.26105569931265776),
            (-0.14645292150347392, 0.08658680006734419, 0.5977128433249629),
            (-0.12849529918121, -0.5663903151536358, -0.20207328259072085),
            (0.06406844006526, 0.1715550260649172, 0.0328588469641727),
        )
    )
    u, v = ((np.arange(1000**2) // k % 1000 + 0.5) / 1000 for k in (1, 1000))
    places = p + e1 * u + e2 * v
    r = np.sqrt(dot(places, places))
    t, z = dot(w, places) / r, dot(n, places) / r
    solid = np.abs(dot(cross(e1, e2), places)) / r**3
    slow = float(np.where((t > 0) & (z > 0), solid * z * np.maximum(t, 1e-9) ** s, 0).mean())
    value, bound = lobe_by_area(np.zeros((3, 1)), n, w, np.array([s]), p, e1, e2)
    assert value[0] == pytest.approx(slow, rel=1e-4)  # the midpoint rule's own error
    assert bound[0] < 1e-12
