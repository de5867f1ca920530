"""Every kind of light in Mitsuba's judgement, and in the diagnosis of an image that is wrong."""

import numpy as np
import pytest
from builders import box, floor, scene

import nusselt
from nusselt.experiments.check.check import Question, References, check
from nusselt.experiments.external.diagnosis import Inputs, diagnose
from nusselt.experiments.images.formats import Raw
from nusselt.experiments.images.transfer import Quantiser, Transfer
from nusselt.experiments.independent.world import read_world
from nusselt.mitsuba_bridge.export import export_scene
from nusselt.mitsuba_bridge.llvm import backend
from nusselt.mitsuba_bridge.reference import Reference, ask
from nusselt.renderer.estimators import Area
from nusselt.renderer.image import render
from nusselt.renderer.lights import CosineLight, SkyLight, SphereLight, SpotLight, TriangleLight
from nusselt.renderer.scene import Camera
from nusselt.renderer.scene_text import write_scene
from nusselt.renderer.surfaces import Material

SHINY = Material((0.6, 0.5, 0.4), (0.3, 0.3, 0.3), 12.0)
VIEW = Camera((0.3, 2.2, 5.0), (0.0, 0.7, 0.0), (0.0, 1.0, 0.0), 42.0)
LAMPS = {
    "spot": (SpotLight((0.4, 2.2, 0.6), (-0.1, -1.0, -0.3), 40.0, 15.0, (6.0, 5.0, 4.0)),),
    "sphere": (SphereLight((-0.6, 1.7, 0.4), 0.35, (6.0, 5.0, 4.0)),),
    "triangle": (
        TriangleLight((-0.9, 2.2, -0.6), (0.4, 2.0, -0.5), (-0.3, 2.4, 0.7), (6.0, 5.0, 4.0)),
        TriangleLight((0.9, 1.2, 0.6), (1.1, 1.6, 0.2), (1.0, 0.9, 0.1), (40.0, 50.0, 60.0)),
    ),
    "sky": (SkyLight((0.5, 0.7, 1.0)),),
    "cosine": (CosineLight((-0.9, 1.4, 0.8), (0.6, -1.0, -0.4), (3.0, 4.0, 5.0)),),
}
"""By the kind that is new."""
KINDS = pytest.mark.parametrize("kind", LAMPS)


def room(*lights, size=(40, 30)):
    """A glossy floor with a block on it that casts shadows."""
    block = box((0.0, 0.0, -0.3), (0.5, 0.8, 0.3))
    return scene(floor(2.0, 0.0, SHINY), block, lights=lights, size=size, camera=VIEW)


@pytest.mark.mitsuba
@pytest.mark.parametrize("kinds", [("spot", "cosine"), ("sphere",), ("triangle",), ("sky",)], ids="-".join)
def test_mitsuba_agrees(kinds):
    made = room(*(light for kind in kinds for light in LAMPS[kind]), size=(24, 18))
    row = check(
        made, Question(estimator="area", samples=64, stratified=True, margin=0.005), command="", references=References()
    ).row
    assert (row["verdict"], row["as_claimed"]) == ("agrees", True), row["reason"]


@pytest.mark.mitsuba
def test_all_of_them_in_a_file_are_what_we_render(tmp_path):
    made = room(*(light for lights in LAMPS.values() for light in lights), size=(24, 18))
    notes = export_scene(made, tmp_path / "all.xml")
    assert any("cosine lights, which the stock mitsuba executable does not know" in note for note in notes)
    job = {
        "task": "image",
        "file": str(tmp_path / "all.xml"),
        "samples": 1024,
        "seed": 1,
        "centres": True,
        "output": "",
    }
    arrays, _ = ask(job, tmp_path, backend(), 120.0)
    ours = render(made, Area(samples=256, stratified=True), seed=1)
    off = arrays["image"].transpose(2, 0, 1) - ours.mean
    # One light a sample is drawn there: 0.2 % of noise, ten of them allowed; the faintest light brings 5 %.
    assert abs(off[:, ours.shaded].mean()) < 0.02 * ours.mean[:, ours.shaded].mean()
    assert np.abs(off[:, ~ours.shaded]).max() < 1e-5


@KINDS
def test_a_wrong_image_is_diagnosed(kind):
    made = room(*LAMPS[kind], size=(24, 18))
    images = [render(made, Area(samples=16), seed=seed) for seed in (1, 2)]
    truth = render(made, Area(samples=1024, stratified=True), seed=3, passes=2)
    raws = [Raw(np.where(image.shaded, 0.5, 1.0) * image.mean) for image in images]
    given = Inputs.against(raws, Quantiser(0, Transfer(), "truncate"), Reference.of_image(truth, "ours", 1024))
    assert diagnose(made, given, 16, False).mistakes[0].name in ("gain", "light-scale")


@KINDS
def test_a_renderer_that_does_not_know_a_kind_says_so(kind):
    with pytest.raises(ValueError, match=r"^\w+ = \[.*\]: expected a light that this renderer knows: quadLight, "):
        read_world(write_scene(room(*LAMPS[kind])))


@pytest.mark.mitsuba
def test_a_narrow_ball_that_mitsuba_does_not_know_is_undecided_and_says_why():
    """Seen under a twentieth of a degree, Mitsuba 3.9 makes it up to a quarter too bright."""
    ball = SphereLight((-0.6, 1.7, 0.4), 8e-4, (1e6, 1e6, 1e6))
    made, references = room(ball, size=(16, 12)), References()
    row = check(made, Question(estimator="area", samples=4), command="", references=references).row
    assert row["verdict"] == "undecided"
    assert "light 1 (sphere) is so narrow that Mitsuba's float32" in row["reason"]
    # What that does not explain stays a finding.
    bright = made.with_(lights=(ball.with_colour((9e6, 9e6, 9e6)),))
    images = [render(bright, Area(samples=4), seed=seed).mean for seed in (1, 2)]
    assert nusselt.check(made, images=images, samples=4).verdict == "differs"
