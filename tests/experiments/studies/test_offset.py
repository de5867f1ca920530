"""Another renderer's ray offset: the rule itself, and that it explains where Mitsuba is wrong."""

from __future__ import annotations

import numpy as np
import pytest
from builders import box, floor, lamp, scene

from nusselt.experiments.studies import offset
from nusselt.mitsuba_bridge import ray_offset
from nusselt.mitsuba_bridge.llvm import Backend
from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import ESTIMATORS, Area
from nusselt.renderer.image import render
from nusselt.renderer.visibility.ray_offset import RayOffset

pytestmark = pytest.mark.mitsuba


def test_rays_start_off_the_surface_and_stop_short():
    rule = RayOffset(1e-2, 0.25, unit=2.0, centre=(1.0, 0.0, 0.0))
    points, normal = np.array([[1.0, 4.0], [0.0, 0.0], [0.0, 0.5]]), np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    d = np.full((3, 2, 1), 8.0)
    origin, reach = rule.moved(points, normal, d, False)
    for k, away in enumerate((0.0, 3.0)):
        step = 1e-2 * (2 + away) * normal[:, k]
        np.testing.assert_allclose(origin[:, k], points[:, k] + step, rtol=1e-15)
        np.testing.assert_allclose(origin[:, k] + reach[:, k, 0], origin[:, k] + 0.75 * (d[:, k, 0] - step), rtol=1e-15)
    assert rule.moved(points, normal, d, True)[1] is d


@pytest.mark.parametrize("kind", ESTIMATORS)
def test_every_estimator_takes_the_offset_or_refuses_it(kind):
    """A blocker within the gap at the light's end, and nothing else in the way: short rays do not see it."""
    shade = box((-0.6, 1.9, -0.6), (0.6, 1.99, 0.6))
    made = scene(floor(), shade, lights=(lamp(2.0),), size=(8, 6))
    if kind.name == "exact":  # it has no rays to move
        with pytest.raises(InputError, match="shadow origin"):
            render(made, kind(samples=4), seed=1, offset=RayOffset(0.0, 0.2))
        return
    full = render(made, kind(samples=4), seed=1)
    short = render(made, kind(samples=4), seed=1, offset=RayOffset(0.0, 0.2))
    bare = render(scene(floor(), lights=(lamp(2.0),), size=(8, 6)), kind(samples=4), seed=1)
    middle = np.s_[:, 3, 3:5]  # floor in front of the camera, in the shadow
    if kind.name == "analytic":
        np.testing.assert_array_equal(full.mean, short.mean)
        return
    assert (full.mean[middle] < short.mean[middle]).all()
    np.testing.assert_allclose(short.mean[middle], bare.mean[middle], rtol=1e-12)


def test_no_offset_is_ours():
    made = scene(floor(), box((-0.5, 0.3, -0.5), (0.5, 0.6, 0.5)), lights=(lamp(),), size=(24, 18))
    a, b = (render(made, Area(samples=9), seed=2, offset=rule) for rule in (None, RayOffset(0.0, 0.0)))
    np.testing.assert_allclose(a.mean, b.mean, rtol=1e-12)


def test_a_mitsuba_with_another_rule_is_refused(monkeypatch):
    monkeypatch.setattr(ray_offset, "_epsilons", lambda _: (float("nan"), float("nan"), "3.10.0"))
    with pytest.raises(InputError, match=r"mitsuba 3\.10\.0"):
        ray_offset.mitsuba_offset(scene(floor()), running=Backend("llvm_ad_rgb", None, ""))


def test_the_rule_explains_a_close_contact():
    """chi^2/n over at least 1000 pixels: sd about 0.045, so that 1 +- 0.3 is beyond 6 sd; 128 passes add 0.016."""
    model, none = offset.run_case(offset.CASES[-2], seed=3, effort=offset.Effort(128, 16, 48, 16))
    assert model["penumbra_pixels"] > 1000
    assert 0.7 < model["chi_squared"] < 1.3
    assert none["chi_squared"] > 5
    assert none["bias_interval"][1] < 0 < model["bias_interval"][1]
