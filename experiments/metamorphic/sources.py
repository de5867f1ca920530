"""Where images come from: one of our estimators, somebody's program, or a function of Python."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from nusselt.experiments.check.question import chosen_estimator
from nusselt.experiments.external.function import FunctionRenderer, RenderFunction
from nusselt.experiments.external.program import Program, ProgramRenderer, Renderer
from nusselt.experiments.images.formats.raw import FLOAT, HALF, Raw
from nusselt.experiments.images.read import quantiser_of
from nusselt.experiments.peers.environment import Environments, default_folder
from nusselt.experiments.peers.renderers import PEERS, peer_of
from nusselt.experiments.scenes.sizes import at_width
from nusselt.mitsuba_bridge.images import mitsuba_images
from nusselt.renderer.errors import InputError
from nusselt.renderer.image import render
from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Floats

from .peer_source import peer_source
from .relation import Shot

MITSUBA = "mitsuba"
TIMEOUT = 600.0
IN_COMMAND = ("seed", "threads")
"""What relations need of a command."""


class Source(Protocol):
    """What makes images."""

    @property
    def name(self) -> str:
        """As rows call it."""
        ...

    @property
    def rounding(self) -> float:
        """Relative error of a value by the images' format."""
        ...

    @property
    def knows(self) -> tuple[str, ...]:
        """What a relation may ask for: kinds of light, what is `IN_COMMAND`."""
        ...

    def claim(self, scene: Scene) -> str:
        """As an estimator's."""
        ...

    def image(self, shot: Shot, seed: int) -> Floats:
        """Radiance (3, h, w)."""
        ...


def sized(scene: Scene, width: int | None, samples: int | None) -> Scene:
    """With other pixels across, of the same shape, and other samples; None: its own."""
    return at_width(scene.with_(light_samples=samples or scene.light_samples), width)


def _sampled(shot: Shot) -> Scene:
    return shot.scene.with_(light_samples=shot.scene.light_samples * shot.more, origin=None)


def _radiance(raw: Raw) -> Floats:
    """Of numbers; levels are no sums of light.

    Raises
    ------
    InputError
    """
    if raw.levels:
        raise InputError("image_type", f"{raw.levels + 1} levels", "an image of radiance: .exr, .hdr, .pfm or .npy")
    return quantiser_of([raw], "linear", "auto").decode(raw)


@dataclass(frozen=True)
class EstimatorSource:
    """One of our estimators, or a user's; ``asked`` as in `Question`."""

    asked: str | None = None
    knows: tuple[str, ...] = ("triangle", "quad", "seed")
    rounding: float = FLOAT.relative

    @property
    def name(self) -> str:
        return self.asked or "the scene's"

    def claim(self, scene: Scene) -> str:
        estimator = chosen_estimator(scene, self.asked, None, None)
        return str(estimator.claim(prepare(scene).needs))

    def image(self, shot: Shot, seed: int) -> Floats:
        scene = _sampled(shot)
        return render(scene, chosen_estimator(scene, self.asked, None, None), seed=seed + shot.step).mean


@dataclass(frozen=True)
class RendererSource:
    """A program, or a function; ``knows`` what the user says it does.

    Parameters
    ----------
    program : Program or callable
    new_kinds : bool
        Whether it knows the kinds of light that relations bring in.
    exact : bool
        Whether its images are claimed to have no noise.
    """

    program: Program | RenderFunction
    new_kinds: bool = False
    exact: bool = False
    name: str = "renderer"

    @property
    def rounding(self) -> float:
        return HALF.relative if isinstance(self.program, Program) else FLOAT.relative

    @property
    def knows(self) -> tuple[str, ...]:
        words = self.program.command if isinstance(self.program, Program) else "{seed}"
        said = tuple(name for name in IN_COMMAND if f"{{{name}}}" in words)
        return *(("triangle", "quad") if self.new_kinds else ()), *said

    def claim(self, scene: Scene) -> str:
        return "exact" if self.exact else "unbiased"

    def image(self, shot: Shot, seed: int) -> Floats:
        scene = _sampled(shot)
        samples, seed = scene.light_samples, seed + shot.step
        if not isinstance(self.program, Program):
            renderer: Renderer = FunctionRenderer(self.program, scene)
            return _radiance(renderer.run(samples, seed).raw)
        with ProgramRenderer(self.program, scene, threads=shot.threads) as ready:
            return _radiance(ready.run(samples, seed).raw)


@dataclass(frozen=True)
class MitsubaSource:
    """Mitsuba's `direct`, which picks one light for each sample."""

    name: str = MITSUBA
    rounding: float = FLOAT.relative
    knows: tuple[str, ...] = ("triangle", "quad", "seed")

    def claim(self, scene: Scene) -> str:
        return "unbiased"

    def image(self, shot: Shot, seed: int) -> Floats:
        scene = _sampled(shot)
        sampler = "stratified" if scene.stratify else "independent"
        seeds = [seed + shot.step]
        return np.asarray(mitsuba_images(scene, scene.light_samples, seeds, sampler=sampler, timeout=TIMEOUT)[0])


def renderer_source(command: str, image_type: str, timeout: float, new_kinds: bool, exact: bool) -> Source:
    """A program by its command, or Mitsuba or another peer by its name.

    Raises
    ------
    InputError
    """
    if command == MITSUBA:
        return MitsubaSource()
    if command in [peer.name for peer in PEERS]:
        return peer_source(peer_of(command), Environments(default_folder()), timeout)
    return RendererSource(Program(command, image_type, timeout), new_kinds, exact)
