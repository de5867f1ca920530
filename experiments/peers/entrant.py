"""Images of one renderer, whoever's it is, and how a peer makes them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from nusselt.experiments.check.question import PixelRule
from nusselt.experiments.external.program import Renderer
from nusselt.experiments.external.shared_noise import different
from nusselt.experiments.images.formats import Raw
from nusselt.experiments.images.read import quantiser_of
from nusselt.renderer.vectors import Floats

from .renderer import PeerRenderer

COARSER = 4
"""Samples of an image without noise over those of the one that measures its method's error: half the points a side."""
ORDER = 3.0
"""Of a midpoint rule, the error left is a third of the step from half its points a side: error falls as 1/n^2."""


@dataclass(frozen=True)
class Entrant:
    """What one renderer says of a scene.

    Parameters
    ----------
    name : str
    rule : {"centre", "area"}
        What its pixels are.
    images : (k, 3, h, w) float64
        Of k seeds; one where nothing is random.
    step : (3, h, w) float64, optional
        Of a method without noise: its image less the one of a quarter of the samples.
    points : int, optional
        On each light that a pixel of one image takes, where it takes such points alone: bounds what a sample can bring.
    version : str
    about : mapping
        For the page: title, licence, samples, settings …
    """

    name: str
    rule: PixelRule
    images: Floats
    step: Floats | None = None
    points: int | None = None
    version: str = ""
    about: Mapping[str, Any] = field(default_factory=dict)

    @property
    def image(self) -> Floats:
        """The mean of the seeds; without noise, what the method tends to as 1/n^2."""
        mean = np.asarray(self.images.mean(axis=0))
        return mean if self.step is None else mean + self.step / ORDER


@dataclass(frozen=True)
class Effort:
    """How much is asked of every renderer: samples (None: each one's own), seeds, and where seeds begin."""

    samples: int | None = None
    seeds: int = 4
    seed: int = 0


def of_peer(
    renderer: PeerRenderer,
    effort: Effort,
    tell: Callable[[], None] = lambda: None,
    options: Mapping[str, Any] | None = None,
) -> Entrant:
    """A peer's images; ``options`` leave what its adapter would set.

    Raises
    ------
    ProgramFailed
    """
    peer, samples = renderer.peer, effort.samples or renderer.peer.samples

    def image(samples: int, seed: int) -> Floats:
        found = renderer.run(samples, seed, options).raw.values
        tell()
        return np.asarray(found, dtype=np.float64)

    seeds = effort.seeds if peer.noise else 1
    images = np.stack([image(samples, effort.seed + k) for k in range(seeds)])
    step = None
    if not peer.noise:  # what is left at a default is taken as it is
        step = 0 * images[0] if options else images[0] - image(max(samples // COARSER, 1), effort.seed)
    about = {
        "title": peer.title,
        "licence": peer.licence,
        "samples": samples,
        "settings": [vars(setting) for setting in peer.settings],
        "unequal": peer.unequal,
    }
    points = samples if peer.rule == "centre" else None
    return Entrant(peer.name, peer.rule, images, step, points, renderer.version, about)


def of_renderer(name: str, renderer: Renderer, rule: PixelRule, samples: int, effort: Effort) -> Entrant:
    """Somebody's renderer beside the peers.

    Raises
    ------
    ProgramFailed
    """
    raws = [renderer.run(samples, effort.seed + 1 + k).raw for k in range(effort.seeds)]
    return of_images(name, raws, rule, {"title": name, "samples": samples})


def of_images(name: str, raws: Sequence[Raw], rule: PixelRule, about: Mapping[str, Any]) -> Entrant:
    """Somebody's images of different seeds; equal ones count once, and say nothing of noise."""
    unique = different(list(raws))
    quantiser = quantiser_of(unique, "linear", "auto")
    images = np.stack([np.asarray(quantiser.decode(raw), dtype=np.float64) for raw in unique])
    return Entrant(name, rule, images, about=about)
