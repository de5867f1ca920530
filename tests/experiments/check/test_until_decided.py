"""Looking again with more samples: parts add up to one run, lie on disk, and are taken up again."""

from __future__ import annotations

import dataclasses
import math
from itertools import pairwise

import numpy as np
import pytest
from builders import floor, lamp, scene

from nusselt.experiments.check import check as check_module
from nusselt.experiments.check import sequential as until_module
from nusselt.experiments.check.question import Question
from nusselt.experiments.check.sequential import check_until
from nusselt.experiments.results.store import Store, key_of
from nusselt.experiments.verdict.evidence import NO_EXPECTATIONS
from nusselt.experiments.verdict.level import Level
from nusselt.experiments.verdict.pooling import combine_images, combine_references
from nusselt.mitsuba_bridge.reference import ReferenceUnavailable, render_reference
from nusselt.renderer.estimators import Area
from nusselt.renderer.image import Image, render

pytestmark = pytest.mark.mitsuba


def lit():
    return scene(floor(), lights=(lamp(1.5),), size=(24, 18))


def test_parts_are_one_run():
    """Mean and variance of 2 + 3 + 4 passes are those of 9, here of the nine stacked."""
    made = lit()
    parts = [render(made, Area(samples=2), seed=seed, passes=passes) for seed, passes in ((1, 2), (2, 3), (3, 4))]
    stack = []
    for seed, passes in ((1, 2), (2, 3), (3, 4)):
        sums = [n * render(made, Area(samples=2), seed=seed, passes=n).mean for n in range(1, passes + 1)]
        stack += [sums[0], *(b - a for a, b in pairwise(sums))]
    whole = combine_images(parts)
    np.testing.assert_allclose(whole.mean, np.mean(stack, axis=0), rtol=1e-12)
    np.testing.assert_allclose(whole.variance, np.var(stack, axis=0, ddof=1), rtol=1e-9, atol=1e-18)
    averages = [image.mean(axis=0) for image in stack]
    np.testing.assert_allclose(whole.pixel_variance, np.var(averages, axis=0, ddof=1), rtol=1e-9, atol=1e-18)
    assert whole.pass_means.size == 9
    np.testing.assert_array_equal(whole.shaded, parts[0].shaded)


def test_references_are_weighted_by_their_samples():
    parts = [
        render_reference(lit(), seed=seed, target_relative_se=1.0, max_samples=most, timeout=60)
        for seed, most in ((1, 128), (2, 512))
    ]
    parts[1] = dataclasses.replace(parts[1], samples=3 * parts[0].samples)
    whole = combine_references(parts)
    np.testing.assert_allclose(whole.mean, (parts[0].mean + 3 * parts[1].mean) / 4, rtol=1e-12)
    slow = np.sqrt(parts[0].pixel_standard_error ** 2 + 9 * parts[1].pixel_standard_error ** 2) / 4
    np.testing.assert_allclose(whole.pixel_standard_error, slow, rtol=1e-12)
    np.testing.assert_allclose(whole.pass_means, (parts[0].pass_means + 3 * parts[1].pass_means) / 4, rtol=1e-12)
    assert whole.samples == 4 * parts[0].samples
    np.testing.assert_array_equal(whole.emitter, parts[0].emitter)


def test_what_is_kept_comes_back_the_same(tmp_path):
    store = Store(tmp_path / "deep" / "er")
    image = render(lit(), Area(samples=2), seed=1, passes=2)
    assert store.get(Image, "a", lambda: image) is image
    back = store.get(Image, "a", lambda: pytest.fail("it is on disk"))
    for field in dataclasses.fields(Image):
        np.testing.assert_array_equal(getattr(back, field.name), getattr(image, field.name))
    assert back.left_out == image.left_out


@pytest.mark.parametrize("damage", [b"", b"PK\x03\x04 and then nothing", b"not an archive"])
def test_a_damaged_part_is_made_again(tmp_path, damage):
    store = Store(tmp_path)
    image = render(lit(), Area(samples=2), seed=1, passes=2)
    store.get(Image, "a", lambda: image)
    (tmp_path / "a.npz").write_bytes(damage)
    assert store.get(Image, "a", lambda: image) is image
    store.get(Image, "a", lambda: pytest.fail("it is on disk again"))


def test_keys_tell_everything_apart():
    assert key_of("a", 1) == key_of("a", 1)
    assert len({key_of("a", 1), key_of("a", 2), key_of("b", 1)}) == 3


@pytest.fixture
def starved(monkeypatch):
    """So few passes at first that the first look cannot decide."""
    monkeypatch.setattr(check_module, "MAX_PASSES", 4)
    monkeypatch.setattr(until_module, "expectations_of", lambda *_: NO_EXPECTATIONS)  # its children take time
    return Question(samples=4, margin=1e-2, level=Level(1e-3, 1))


def test_looks_are_added_until_it_is_decided_and_taken_up_again(tmp_path, starved, monkeypatch):
    first = check_until(lit(), starved, command="", folder=tmp_path, budget=0.0)
    assert first.row["verdict"] == "undecided"
    assert first.row["looks"] == 1
    assert first.row["samples_to_decide"]["ours"] > first.row["samples"] * first.row["passes"]
    last = check_until(lit(), starved, command="", folder=tmp_path, budget=120.0)
    assert last.row["verdict"] == "agrees"
    assert last.row["looks"] > 1
    assert last.row["passes"] == sum(math.ceil(4 * until_module.share_of(k)) for k in range(1, last.row["looks"] + 1))
    assert last.ours.pass_means.size == last.row["passes"]

    def fail(*_, **__):
        raise AssertionError("everything is on disk")

    for module in (until_module, check_module):
        monkeypatch.setattr(module, "render", fail)
        monkeypatch.setattr(module, "render_reference", fail)
    again = check_until(lit(), starved, command="", folder=tmp_path, budget=0.0)
    assert again.row["bias_interval"] == last.row["bias_interval"]
    assert not [path for path in tmp_path.rglob(".*") if path.is_file()]  # nothing half-written


def test_a_reference_that_fails_at_the_first_look_is_said(tmp_path, starved, monkeypatch):
    def fail(*_, **__):
        raise ReferenceUnavailable("no Mitsuba today")

    monkeypatch.setattr(until_module, "render_reference", fail)
    row = check_until(lit(), starved, command="", folder=tmp_path, budget=60.0).row
    assert (row["verdict"], row["as_claimed"]) == ("undecided", None)
    assert "no Mitsuba today" in row["reason"]


def test_what_changes_an_image_changes_where_it_is_kept(tmp_path):
    asked = Question(samples=4)
    others = (
        dataclasses.replace(asked, **change)
        for change in ({"seed": 1}, {"pixel_rule": "area"}, {"pixel_rule": "area", "tolerance": 0.5})
    )
    folders = [until_module.Sides(lit(), q, tmp_path, None, None).ours_on_disk.folder for q in (asked, *others)]
    assert len(set(folders)) == 4
