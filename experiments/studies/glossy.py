"""Phong exponents: the narrower the lobe, the worse it is sampled from the light; the closed form does not mind."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from nusselt.experiments.results.figures import curves, strip
from nusselt.experiments.runs.experiment import Experiment, Job, Outcome, Settings
from nusselt.experiments.runs.measure import SURE, measured, truth_of
from nusselt.experiments.scenes.sizes import small
from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import Analytic, Area
from nusselt.renderer.image import render
from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene import Scene
from nusselt.renderer.surfaces import Material

EXPONENTS = (0.0, 1.0, 10.0, 100.0, 1000.0, 10000.0)
SAMPLES = 16


def shiny(scene: Scene, exponent: float) -> Scene:
    """The scene with half of every surface's albedo in a lobe of this exponent."""

    def made(material: Material) -> Material:
        r, g, b = (c / 2 for c in material.diffuse)
        return replace(material, diffuse=(r, g, b), specular=(r, g, b), shininess=exponent)

    meshes = tuple(replace(mesh, material=made(mesh.material)) for mesh in scene.meshes)
    balls = tuple(replace(ball, material=made(ball.material)) for ball in scene.ellipsoids)
    return scene.with_(meshes=meshes, ellipsoids=balls)


def compare(scene: Scene, exponent: float, passes: int, seed: int) -> Outcome:
    """Area sampling, random and stratified, against the closed form of the lobe."""
    glossy = shiny(scene, exponent)
    started = time.perf_counter()
    image = render(glossy, Analytic())
    seconds = time.perf_counter() - started
    truth = truth_of(glossy, seed)
    found, noisy = measured(glossy, Area(samples=SAMPLES), truth, seed + 1, passes)
    strata, _ = measured(glossy, Area(samples=SAMPLES, stratified=True), truth, seed + 2, passes)
    row = {"scene": scene.name, "exponent": exponent, "samples": SAMPLES, "passes": passes, "truth": truth.name}
    row |= {"rms_random": found["rms_relative"], "rms_stratified": strata["rms_relative"]}
    row |= {"bias_standard_errors": found["bias_standard_errors"], "seconds": {"analytic": seconds}}
    right = abs(found["bias_standard_errors"]) < SURE and abs(strata["bias_standard_errors"]) < SURE
    return Outcome([row | {"as_claimed": right}], {"closed form": image.mean, "area": noisy})


def jobs(settings: Settings) -> list[Job]:
    """One a scene and exponent."""
    width, passes = settings.pick((240, 32), (48, 16), (8, 4))
    scenes = settings.chosen(GLOSSY.scenes)
    for scene in scenes:
        if prepare(scene).needs.visibility:
            raise InputError(
                "--scenes", scene.name, "scenes in which nothing blocks: the closed form is the truth here"
            )
    return [
        Job(
            compare,
            {"scene": small(scene, width), "exponent": s, "passes": passes, "seed": settings.seed_of(scene.name, s)},
        )
        for scene in scenes
        for s in EXPONENTS
    ]


def figures(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """A strip of images, and error against the exponent."""
    found = {}
    for scene in dict.fromkeys(outcome.rows[0]["scene"] for outcome in outcomes):
        some = [outcome for outcome in outcomes if outcome.rows[0]["scene"] == scene]
        exponents = [outcome.rows[0]["exponent"] for outcome in some]
        images = [
            (kind, [(f"exponent {s:g}", outcome.arrays[kind]) for s, outcome in zip(exponents, some, strict=True)])
            for kind in ("closed form", "area")
        ]
        title = f"{scene}, half of the albedo in the lobe: closed form; area sampling, {SAMPLES} random per light"
        found[f"strip-{scene}"] = strip(images, title)
        lines = {
            kind: ([s + 0.1 for s in exponents], [outcome.rows[0][f"rms_{kind}"] for outcome in some])
            for kind in ("random", "stratified")
        }
        title = f"{scene}: area sampling, {SAMPLES} per light, against the closed form"
        found[f"error-{scene}"] = curves(lines, "Phong exponent + 0.1", "relative RMS of a pixel", title)
    return found


GLOSSY = Experiment(
    "glossy", "Phong exponents 0 to 10,000: noise of sampling, closed form", jobs, figures, ("unshadowed",)
)

if __name__ == "__main__":
    from nusselt.experiments.runs.script import script

    script(GLOSSY)
