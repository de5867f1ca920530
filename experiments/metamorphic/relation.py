"""What a relation is: a scene, others made of it, and how their images must hang together."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import ndimage

from nusselt.experiments.search.judge import seen
from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Bools, Floats

Images = list[Floats]
"""(3, h, w) of the scene itself, then of every shot."""


@dataclass(frozen=True, eq=False)
class Shot:
    """An image that is asked for.

    Parameters
    ----------
    scene : Scene
    more : int
        How many times the samples.
    step : int
        What is added to the seed.
    threads : int, optional
        None: as many as there are.
    """

    scene: Scene
    more: int = 1
    step: int = 0
    threads: int | None = None


@dataclass(frozen=True, eq=False)
class Related:
    """Images, and what must be equal.

    Parameters
    ----------
    of : Scene
        The scene whose pixels are compared.
    shots : tuple of Shot
        What is rendered beside the scene.
    sides : callable
        `Images` to what is seen and what is expected, each (3, h, w).
    place : callable
        From an image of ``of``, (..., h, w), to the pixels that are compared.
    hidden : (h, w) bool, optional
        Pixels, of those that are compared, of which nothing is known.
    bound : float
        How far right images may be apart, relative to their mean: 0 where the relation is exact.
    stirs : bool
        Whether images that are equal, although they have noise, break it.
    still : bool
        Whether images are known to have no noise, whatever shines.
    """

    of: Scene
    shots: tuple[Shot, ...]
    sides: Callable[[Images], tuple[Floats, Floats]]
    place: Callable[[Any], Any] = lambda image: image
    hidden: Bools | None = None
    bound: float = 0.0
    stirs: bool = False
    still: bool = False

    @property
    def soft(self) -> bool:
        """Whether an image of it may have noise."""
        if self.still:
            return False
        return any(map(may_have_noise, (self.of, *(shot.scene for shot in self.shots))))


def may_have_noise(scene: Scene) -> bool:
    """Whether anything in an image of it is sampled."""
    return scene.spp > 1 or any(light.has_extent for light in scene.lights)


Make = Callable[[Scene, np.random.Generator], Related | str]


@dataclass(frozen=True)
class Relation:
    """A relation that right images keep.

    Parameters
    ----------
    name : str
    expects : str
        The effect on the image.
    likely : str
        What is likely wrong in a renderer that breaks it.
    make : callable
        Scene and chance to `Related`, or to the reason why the scene has no such relation.
    kinds : tuple of str
        What it asks for that a renderer may not know: kinds of light, seeds, threads.
    """

    name: str
    expects: str
    likely: str
    make: Make
    kinds: tuple[str, ...] = ()


def same(scene: Scene, other: Scene, **more: Any) -> Related:
    """Another scene that looks the same."""
    return Related(scene, (Shot(other),), lambda images: (images[1], images[0]), **more)


def seen_within(scene: Scene, within: Callable[[Floats], Bools]) -> Bools:
    """Pixels (h, w) whose centre shows a point, of (3, n), within something; around them too where they are areas."""
    one = seen(scene)
    with np.errstate(invalid="ignore"):  # of rays that meet nothing
        inside = within(one.view.hits.position + one.anchor[:, None]) & (one.view.hits.surface >= 0)
    found = inside.reshape(scene.height, scene.width)
    return np.asarray(ndimage.binary_dilation(found, np.ones((3, 3))) if scene.spp > 1 else found)


def changed_view(scene: Scene, other: Scene) -> Bools:
    """Pixels (h, w) whose central ray meets something else, or at another place; none where they are areas."""
    shape = scene.height, scene.width
    if scene.spp > 1:
        return np.zeros(shape, dtype=bool)
    one, two = (seen(which).view.hits.distance for which in (scene, other))
    with np.errstate(invalid="ignore"):  # of rays that meet nothing
        return np.asarray(~((one == two) | (np.abs(one - two) <= 1e-9 * np.abs(one)))).reshape(shape)
