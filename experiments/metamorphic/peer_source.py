"""A peer as what makes images: what it can show, and what its method may be off by, it says of itself."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from nusselt.experiments.images.formats.raw import FLOAT
from nusselt.experiments.peers.description import describe
from nusselt.experiments.peers.entrant import COARSER, ORDER
from nusselt.experiments.peers.environment import Environments
from nusselt.experiments.peers.peer import Peer
from nusselt.experiments.peers.renderer import PeerRenderer
from nusselt.experiments.peers.workshop import Workshop
from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import Area
from nusselt.renderer.image import render
from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Floats

from .relation import Shot

SAMPLES = 16
LEAST = 64
"""Of a light, of a method without noise: with fewer its step does not tell what it is off by."""
KEPT = 64
"""Images without noise, at most, that are not made again for another seed."""


@dataclass(frozen=True)
class PeerSource:
    """A peer that is there, its adapter kept running; of `Environments.launch`.

    Parameters
    ----------
    name : str
    peer : Peer
    launch : tuple of str
    timeout : float
        Seconds of one image.
    """

    name: str
    peer: Peer = field(repr=False)
    launch: tuple[str, ...] = field(repr=False)
    timeout: float = 600.0
    rounding: float = FLOAT.relative
    cannot: tuple[str, ...] = ()
    """Of `hunt.scenes.NAMES`: what a description has no arrays for, lights of a size that lengths fixed in the renderer
    do not suit, and Phong's lobe if its own is another."""
    _kept: dict[tuple[str, int], Floats] = field(default_factory=dict, repr=False, compare=False)

    @cached_property
    def _workshop(self) -> Workshop:
        return Workshop(list(self.launch))

    @property
    def samples(self) -> int:
        """Of a light, unless it is asked otherwise; a method without noise needs its own."""
        return SAMPLES if self.peer.noise else self.peer.samples

    @property
    def knows(self) -> tuple[str, ...]:
        return ("quad", "seed") if self.peer.noise else ("quad",)

    def claim(self, scene: Scene) -> str:
        return "unbiased"

    def refusal(self, scene: Scene) -> str:
        """Why it cannot show a scene; "" where it can."""
        if self.peer.gloss and scene.is_glossy:
            return f"{self.peer.title} has no such lobe: {self.peer.gloss}"
        if (self.peer.rule == "centre") != (scene.spp == 1):
            return f"{self.peer.title} takes pixels' {self.peer.rule}s alone: say --pixel-rule {self.peer.rule}"
        try:
            describe(scene)
        except InputError as error:
            return f"{self.peer.title}: {error}"
        if not scene.two_sided and render(scene, Area(samples=1)).back_faces:
            return "surfaces are seen from behind: peers' have no black back: say --two-sided"
        return ""

    def image(self, shot: Shot, seed: int) -> Floats:
        """Radiance (3, h, w); of a method without noise, what it tends to as 1/n^2."""
        scene, samples = shot.scene, shot.scene.light_samples * shot.more
        if self.peer.noise:
            return self._made(scene, samples, seed + shot.step)
        return np.asarray(self._still(scene, max(samples, LEAST)) + self.step(shot) / ORDER)

    def step(self, shot: Shot) -> Floats:
        """Of a method without noise: its image less the one of a quarter of the samples; else nothing."""
        scene, samples = shot.scene, max(shot.scene.light_samples * shot.more, LEAST)
        if self.peer.noise:
            return np.zeros((3, scene.height, scene.width))
        return np.asarray(self._still(scene, samples) - self._still(scene, samples // COARSER))

    def _still(self, scene: Scene, samples: int) -> Floats:
        """An image without noise."""
        key = scene.digest(), samples
        if key not in self._kept:
            if len(self._kept) >= KEPT:
                self._kept.clear()
            self._kept[key] = self._made(scene, samples, 0)
        return self._kept[key]

    def _made(self, scene: Scene, samples: int, seed: int) -> Floats:
        with PeerRenderer(self.peer, [], scene, self.timeout, workshop=self._workshop) as renderer:
            return np.asarray(renderer.run(samples, seed).raw.values, dtype=np.float64)


def peer_source(peer: Peer, environments: Environments, timeout: float = 600.0) -> PeerSource:
    """A peer of these environments.

    Raises
    ------
    InputError
        If it is not there.
    """
    launch = environments.launch(peer)
    if launch is None:
        raise InputError(
            "renderer", peer.name, f"a peer that is there; this one is had by: {environments.status(peer)}"
        )
    cannot = ("point", "directional", "thin light", "vast light", "ellipsoid", *(("glossy",) if peer.gloss else ()))
    return PeerSource(peer.name, peer, tuple(launch), timeout, cannot=cannot)
