"""Who makes the images that are compared with each other, and of what size: options of several commands."""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from pathlib import Path

import click

from nusselt.experiments.images.read import READERS
from nusselt.experiments.metamorphic.sources import EstimatorSource, Source, renderer_source, sized
from nusselt.experiments.terminal.options import together, width_option
from nusselt.renderer.errors import InputError
from nusselt.renderer.scene import Scene


@dataclass(frozen=True)
class Made:
    """Who makes the images, and of what size."""

    renderer: str | None
    estimator: str | None
    image_type: str
    run_timeout: float
    new_kinds: bool
    exact: bool
    width: int | None
    samples: int | None

    @property
    def source(self) -> Source:
        if self.renderer is None:
            return EstimatorSource(self.estimator)
        if self.estimator is not None:
            raise InputError("estimator", self.estimator, "an estimator of ours or a renderer, not both")
        return renderer_source(self.renderer, self.image_type, self.run_timeout, self.new_kinds, self.exact)

    @property
    def files(self) -> tuple[Path, ...]:
        """That its command names: the program, a script."""
        words = map(Path, shlex.split(self.renderer or ""))
        return tuple(word for word in words if word.is_file())

    def scene(self, scene: Scene) -> Scene:
        return sized(scene, self.width, self.samples)


OPTIONS = (
    click.option(
        "--renderer", metavar="COMMAND", help="A program with {scene} or {xml}, {output} …; or a peer: mitsuba …"
    ),
    click.option("--image-type", type=click.Choice(list(READERS)), default=".exr", show_default=True),
    click.option("--run-timeout", type=click.FloatRange(0, min_open=True), default=600.0, show_default=True),
    click.option("--new-kinds", is_flag=True, help="The renderer knows quad and triangle lights."),
    click.option("--exact", is_flag=True, help="The renderer claims images without noise."),
    width_option,
    click.option("--samples", type=click.IntRange(1, 1 << 24), help="Per light, instead of the scene's."),
)
estimator_option = click.option("--estimator", metavar="NAME", help="Instead of the scene's. See: list.")
made_options = together(Made, "made", *OPTIONS, estimator_option)
