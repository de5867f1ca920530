"""Mitsuba's own offset: where it is wrong, the model of it is wrong in the same way.

Up to 3.9 its shadow rays start off the surface by an absolute length. In small scenes and under close contacts
that is seen: the bridge's scaling switched off, penumbrae of scenes of size 1e-3 to 1e3, and of contacts 1e-1 to
1e-4 above the floor, are compared pixel by pixel with ours, once as we trace and once by Mitsuba's rule.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any

import numpy as np

from nusselt.experiments.check.check import seeds
from nusselt.experiments.results.figures import BLUE, GREY, RED, canvas, name_lines
from nusselt.experiments.results.study_tables import table
from nusselt.experiments.runs.experiment import Experiment, Job, Outcome, Settings
from nusselt.experiments.scenes.shapes import lamp, plate
from nusselt.experiments.verdict.intervals import pooled_bias
from nusselt.mitsuba_bridge.ray_offset import mitsuba_offset
from nusselt.mitsuba_bridge.reference import Reference, render_reference
from nusselt.renderer.estimators import Area
from nusselt.renderer.image import Image, render
from nusselt.renderer.scene import Camera, Scene
from nusselt.renderer.surfaces import Material
from nusselt.renderer.vectors import Bools, Floats

EDGE = (1e-3, 1 - 1e-3)
"""A penumbra is where this share of the light is seen."""
FITS = (0.9, 1.15)
"""chi^2/n of a right model."""
PIXELS = 2000
"""Fewest penumbra pixels that show a fit."""
LEVEL = 1e-3
MATERIAL = Material((0.5, 0.5, 0.5))


@dataclass(frozen=True)
class Effort:
    """Passes and samples of each.

    Parameters
    ----------
    passes, samples : int
        Mitsuba's, 16,384 samples a pixel: in passes enough that the mean of t^2 is 1.008.
    our_passes, our_samples : int
    """

    passes: int = 256
    samples: int = 64
    our_passes: int = 64
    our_samples: int = 64

    @property
    def estimator(self) -> Area:
        return Area(samples=self.our_samples, stratified=True)


FULL, TINY = Effort(), Effort(32, 4, 4, 4)


@dataclass(frozen=True)
class Case:
    """A blocker over a floor, its edge under the middle of a square light.

    Parameters
    ----------
    name : str
    size : float
        Of everything: the light hangs 2 sizes above the floor and is one size wide.
    contact : float
        Height of the blocker over the floor, in sizes.
    """

    name: str
    size: float
    contact: float


CASES = (
    *(Case(f"size {size:g}", size, 0.25) for size in (1e-3, 1e-2, 1e-1, 1.0, 1e1, 1e2, 1e3)),
    *(Case(f"contact {height:g}", 1.0, height) for height in (1e-1, 1e-2, 1e-3, 1e-4)),
)


def contact_scene(case: Case, lift: float) -> Scene:
    """The camera looks under the blocker's edge: nearly every pixel lies in the penumbra of rays lifted so far.

    The surfaces end close around what is seen: a hit on a triangle is right to 1e-7 of the triangle's size.
    """
    s, h = case.size, case.size * case.contact
    width = 0.5 * (h - lift) * s / (2 * s - h)  # of half the penumbra
    reach = 6 * h
    light = lamp((-s / 2, s / 2), (-s / 2, s / 2), 2 * s, (5.0, 5.0, 5.0))
    camera = Camera((5 * h, 3 * h, 0.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), math.degrees(2 * math.atan(width / 8 / h)))
    meshes = (
        plate((-reach, reach), (-reach, reach), 0.0, MATERIAL),
        plate((-reach, 0.0), (-reach, reach), h, MATERIAL),
    )
    return Scene(64, 48, camera, meshes, (), (light,), name=case.name)


def penumbra(scene: Scene, ours: Image, estimator: Area) -> Bools:
    """Pixels that see part of the light, (h, w): from ours, and the same image without the blocker."""
    free = render(scene.with_(meshes=scene.meshes[:1]), estimator, seed=1)
    share = ours.mean.mean(axis=0) / np.maximum(free.mean.mean(axis=0), 1e-300)
    return np.asarray(ours.shaded & ~ours.unjudged & (share > EDGE[0]) & (share < EDGE[1]))


def compare(ours: Image, reference: Reference, pixels: Bools) -> dict[str, Any]:
    """Pixel by pixel: chi^2/n is the mean squared difference over both sides' variance, 1 where only noise differs."""
    difference = (ours.mean - reference.mean).mean(axis=0)[pixels]
    noise: Floats = ours.pixel_variance[pixels] / ours.pass_means.size + reference.pixel_standard_error[pixels] ** 2
    bias = pooled_bias(difference, noise, np.zeros(1))
    scale = float(reference.mean.mean(axis=0)[pixels].mean())
    return {
        "chi_squared": float((difference**2 / noise).mean()),
        "bias_relative": bias.value / scale,
        "bias_interval": [(bias.value + sign * bias.half_width(LEVEL)) / scale for sign in (-1, 1)],
    }


def run_case(
    case: Case, seed: int, effort: Effort = FULL, executor: Executor | None = None
) -> Iterator[dict[str, Any]]:
    """Two rows: by Mitsuba's rule, which must fit, and traced as we do, which shows what the rule does.

    Raises
    ------
    ReferenceUnavailable, InputError
        If Mitsuba cannot run, or its rule is not the modelled one.
    """
    started = time.perf_counter()
    bare = mitsuba_offset(contact_scene(case, 0.0), normalise=False)
    scene = contact_scene(case, bare.lift)
    _, our_seed, their_seed = seeds(seed, case.name)
    reference = render_reference(
        scene,
        seed=their_seed,
        target_relative_se=0.0,
        max_samples=effort.passes * effort.samples,
        passes=effort.passes,
        timeout=600.0,
        normalise=False,
    )
    pixels: Bools | None = None
    for model in (bare, None):
        ours = render(
            scene,
            effort.estimator,
            seed=our_seed,
            passes=effort.our_passes,
            executor=executor,
            offset=model,
        )
        pixels = penumbra(scene, ours, effort.estimator) if pixels is None else pixels
        found = compare(ours, reference, pixels)
        fits = FITS[0] <= found["chi_squared"] <= FITS[1]
        yield {
            "scene": case.name,
            "case": "mitsuba's rule" if model else "from the surface",
            "size": case.size,
            "contact": case.contact,
            "penumbra_pixels": int(pixels.sum()),
            "samples": reference.samples,
            **found,
            "as_claimed": (fits if model else True) and int(pixels.sum()) >= PIXELS,
            "seconds": time.perf_counter() - started,
        }


def case_job(number: int, seed: int, effort: Effort) -> Outcome:
    """Both rows of a case, by its place."""
    return Outcome(list(run_case(CASES[number], seed, effort)))


def jobs(settings: Settings) -> list[Job]:
    """All cases; one small scene and one contact where it must be quick."""
    contact = len(CASES) - 2
    chosen, effort = settings.pick((range(len(CASES)), FULL), ((0, contact), FULL), ((contact,), TINY))
    told = {"seed": settings.seed, "effort": effort}
    return [Job(case_job, {"number": number, **told}, alone=True) for number in chosen]


def figures(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """chi^2/n with the rule and without it."""
    figure = canvas(7.5, 0.3 * len(outcomes) + 1.4)
    axis = figure.subplots()
    for number, (case, colour) in enumerate((("mitsuba's rule", BLUE), ("from the surface", RED))):
        values = [outcome.rows[number]["chi_squared"] for outcome in outcomes]
        axis.plot(values, range(len(values)), "o", color=colour, label=case)
    axis.axvspan(*FITS, color=GREY, alpha=0.3)
    axis.set_xscale("log")
    axis.set_yticks(range(len(outcomes)), [outcome.rows[0]["scene"] for outcome in outcomes])
    axis.set_xlabel("chi^2/n over penumbra pixels, 16,384 samples of Mitsuba's")
    axis.set_title("Mitsuba's ray offset, the bridge's scaling off: modelled, and not", fontsize=10)
    name_lines(axis)
    return {"offset": figure}


OFFSET = Experiment(
    "offset",
    "where Mitsuba's ray offset is wrong, its model is wrong in the same way",
    jobs,
    figures,
    table=lambda rows, width: table([plain_row(row) for row in rows], "Mitsuba's ray offset", width),
)


def plain_row(row: dict[str, Any]) -> dict[str, Any]:
    """What fits a terminal."""
    names = ("scene", "case", "penumbra_pixels", "chi_squared", "bias_relative", "as_claimed")
    return {name: row[name] for name in names}


if __name__ == "__main__":
    from nusselt.experiments.runs.script import script

    script(OFFSET)
