"""`nusselt.render` and `nusselt.read_scene`: our image alone, without Mitsuba."""

from __future__ import annotations

import io
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from nusselt.experiments.check.draw import Drawing, Drawn, draw
from nusselt.experiments.check.layers import drawn_layers
from nusselt.experiments.check.question import PixelRule, ShadowOrigin
from nusselt.experiments.check.request import Reading, SceneLike
from nusselt.experiments.images.formats.png import to_levels
from nusselt.experiments.images.write import check_image_name, write_image
from nusselt.experiments.results.layers import check_layered_name, write_layers
from nusselt.experiments.workers import PATIENCE, worker_pool
from nusselt.renderer.estimators import Estimator
from nusselt.renderer.image import Image
from nusselt.renderer.scene import Scene

from .arguments import known_arguments


@dataclass(frozen=True)
class Picture:
    """An image of ours; a notebook shows it in the course's eight bits.

    Parameters
    ----------
    drawn : Drawn
    scene : Scene
    drawing : Drawing
        What was asked.
    """

    drawn: Drawn
    scene: Scene
    drawing: Drawing

    @property
    def image(self) -> Image:
        """All that is known of it: variance, bounds, what was left out."""
        return self.drawn.image

    @property
    def array(self) -> NDArray[np.float64]:
        """Radiance (h, w, 3), W m^-2 sr^-1."""
        return np.ascontiguousarray(self.image.mean.transpose(1, 2, 0))

    @property
    def warnings(self) -> tuple[str, ...]:
        """What is to be known before it is used."""
        return self.drawn.warnings

    @property
    def told(self) -> tuple[str, ...]:
        """What is known of its error."""
        return self.drawn.told

    def write(self, path: str | PathLike[str], *, bits: int | None = None, aovs: bool = False) -> None:
        """Write it as .png (in 8 bits, or 16), .exr or .npy; ``aovs``: an .exr with all layers."""
        check_layered_name(Path(path), aovs)
        if not aovs:
            return write_image(Path(path), self.image.mean, bits)
        check_image_name(Path(path), bits)
        with worker_pool(None, PATIENCE) as pool:
            return write_layers(Path(path), *drawn_layers(self.scene, self.image, self.drawing, pool))

    def _repr_png_(self) -> bytes:
        from PIL import Image as Pillow

        stream = io.BytesIO()
        Pillow.fromarray(to_levels(self.image.mean).transpose(1, 2, 0)).save(stream, "PNG")
        return stream.getvalue()


@known_arguments
def read_scene(
    scene: SceneLike,
    *,
    lenient: bool = False,
    two_sided: bool = False,
    as_diffuse: bool = False,
    as_mesh: bool = False,
) -> Scene:
    """A scene from its file or from what `mi.load_dict` takes, or a classic one by its name.

    Raises
    ------
    InputError
        If there is no such file, or its content is not a scene.
    """
    return Reading(lenient, two_sided, as_diffuse, as_mesh).scene(scene)


@known_arguments
def render(
    scene: SceneLike,
    *,
    estimator: str | type[Estimator] | None = None,
    samples: int | None = None,
    stratified: bool | None = None,
    seed: int = 0,
    shadow_origin: ShadowOrigin = "surface",
    pixel_rule: PixelRule | None = None,
    tolerance: float | None = None,
    error: float | None = None,
    lenient: bool = False,
    two_sided: bool = False,
    as_diffuse: bool = False,
    as_mesh: bool = False,
) -> Picture:
    """Our image of a scene, as `nusselt render` makes it.

    Parameters
    ----------
    scene : str, path, dict or Scene
    estimator, samples, stratified, seed, shadow_origin, pixel_rule, tolerance, error
        As in `nusselt.experiments.check.draw.Drawing`.
    lenient, two_sided, as_diffuse, as_mesh : bool
        How the scene is read.

    Raises
    ------
    InputError
        As the command line has it.
    """
    drawing = Drawing(estimator, samples, stratified, seed, shadow_origin, pixel_rule, tolerance, error)
    read = Reading(lenient, two_sided, as_diffuse, as_mesh).scene(scene, pixel_rule)
    with worker_pool(None, PATIENCE) as pool:
        return Picture(draw(read, drawing, pool), read, drawing)
