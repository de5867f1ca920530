"""The classic scenes, together: every one agrees, with the scores the course's feedback gives right images."""

from __future__ import annotations

import json
import shutil

import pytest
from click.testing import CliRunner

from nusselt.experiments.check.question import chosen_estimator
from nusselt.experiments.cli.main import main
from nusselt.experiments.scenes import catalogue
from nusselt.renderer.image import render

pytestmark = pytest.mark.mitsuba

PUBLISHED = {
    "quad": (0.0, 0.05),
    "quad-random": (29.0, 0.05 * 29.0),
    "quad-stratified": (3.8, 0.05 * 3.8),
    "three-lights": (2.8, 0.05 * 2.8),
    "cornell": (0.90, 0.10 * 0.90),
}
"""The course's "variance" in levels squared, and how far from it a right image may be."""


SMALLER = {
    "three-lights": ("640 480", "240 180"),
    "cornell": ("480 480", "216 216"),
    "cornell-boxes": ("256 256", "128 128"),
    "cornell-glossy": ("160 160", "112 112"),
    "glossy": ("256 256", "128 128"),
}
"""Those that take long, and what they are drawn at here: passes are added until the interval is as narrow as ever."""
MARGIN = 2e-3
"""Twice the usual one, for a quarter of the samples: `make check` has the usual one."""


def with_fewer_pixels(folder):
    """The classic scenes' files, some of them smaller."""
    copy = shutil.copytree(catalogue.FOLDER, folder / "scenes", ignore=shutil.ignore_patterns("*.py", "__pycache__"))
    for name, (size, smaller) in SMALLER.items():
        text = (copy / f"{name}.test").read_text()
        assert f"size {size}" in text
        (copy / f"{name}.test").write_text(text.replace(f"size {size}", f"size {smaller}"))
    return copy


@pytest.fixture(scope="module")
def everything(tmp_path_factory):
    folder = tmp_path_factory.mktemp("classic")
    target = folder / "results.json"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(catalogue, "FOLDER", with_fewer_pixels(folder))
        result = CliRunner().invoke(main, ["check", "--classic", "--margin", str(MARGIN), "--json", str(target)])
    assert result.exit_code == 0, result.output
    return json.loads(target.read_text())["rows"]


@pytest.fixture(scope="module")
def rows(everything):
    """The scenes with their own estimators."""
    return {row["scene"]: row for row in everything if row["estimator"] != "exact"}


def test_soft_shadows_are_checked_without_noise_too(everything):
    exact = [row for row in everything if row["estimator"] == "exact"]
    assert tuple(row["scene"] for row in exact) == catalogue.ALSO_EXACT
    for row in exact:
        assert row["claim"] == "exact"
        assert row["passes"] == 1
        assert row["command"] == f"nusselt check {row['scene']} --estimator exact --margin {MARGIN}"
        assert any(entry["what"] == "further passes of ours" for entry in row["left_out"])


def test_every_classic_scene_agrees_within_the_margin(rows, everything):
    assert tuple(rows) == tuple(name for name in catalogue.CLASSIC if name not in catalogue.DARK)
    for row in everything:
        low, high = row["bias_interval"]
        assert row["verdict"] == "agrees", row["reason"]
        assert row["as_claimed"] is True
        assert -MARGIN <= low <= high <= MARGIN
        assert row["non_finite"] == 0
        assert row["minimum_detectable_bias"] < 3 * MARGIN


@pytest.mark.parametrize("name", PUBLISHED)
def test_course_scores_are_those_published(rows, name):
    score, reach = PUBLISHED[name]
    row = rows[name]
    if name not in SMALLER:
        assert abs(row["course_mse"] - score) <= reach
    assert round(abs(row["course_bias"]), 1) == 0.0
    low, high = row["course_expected"]["mse"]
    assert low <= max(row["course_mse"], 0.0) <= high


@pytest.mark.parametrize("name", sorted(SMALLER.keys() & PUBLISHED.keys()))
def test_scores_to_expect_at_full_size_are_those_published(name):
    """The variance of our levels: scores of fewer pixels, where penumbrae are more of the image, are others."""
    score, reach = PUBLISHED[name]
    scene = catalogue.load(name)
    image = render(scene, chosen_estimator(scene, None, None, None), passes=2)
    assert abs(image.level_variance.mean() - score) <= reach


def test_few_pixels_are_not_judged(rows):
    for row in rows.values():
        assert row["pixels"]["unjudged"] <= 1e-3 * sum(row["pixels"].values())
        assert sum(row["pixels"].values()) >= row["pixels"]["shaded"] > 10_000


def test_a_folder_named_as_a_scene_hides_none(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("cornell", "mesh"):
        (tmp_path / name).mkdir()
        assert catalogue.load(name).lights
    assert catalogue.file_of("cornell").name == "cornell.test"
