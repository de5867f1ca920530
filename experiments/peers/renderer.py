"""A peer, ready for one scene: a renderer as `external.program.Renderer` has it."""

from __future__ import annotations

import json
import math
import tempfile
import time
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from nusselt.experiments.check.question import with_pixel_rule
from nusselt.experiments.external.program import ProgramFailed, Run, call
from nusselt.experiments.images.formats import Raw
from nusselt.experiments.images.read import raw_of
from nusselt.experiments.results.document import package_versions
from nusselt.experiments.scenes.catalogue import load
from nusselt.experiments.workers import cores
from nusselt.mitsuba_bridge.images import mitsuba_images
from nusselt.mitsuba_bridge.process import ReferenceUnavailable
from nusselt.renderer.errors import InputError
from nusselt.renderer.scene import Scene

from .description import write_description
from .peer import Peer
from .workshop import Workshop


@dataclass(frozen=True)
class Spent:
    """What an image took, in seconds; NaN: not told.

    Parameters
    ----------
    wall, processor : float
        Rendering alone, as `Peer.timed` says: by the clock, and of all processors.
    start : float
        Of all processors, for everything else.
    """

    wall: float = math.nan
    processor: float = math.nan
    start: float = math.nan


class PeerRenderer:
    """A peer and one scene's description; a context manager that cleans up.

    Parameters
    ----------
    peer : Peer
    launch : list of str
        Words that run its adapter, from `Environments.launch`.
    scene : Scene
    timeout : float
        Seconds of one image.
    threads : int, optional
        As many as there are processors, unless it says otherwise.
    workshop : Workshop, optional
        The adapter as it runs already; none: one is started for every image.
    """

    def __init__(
        self,
        peer: Peer,
        launch: list[str],
        scene: Scene,
        timeout: float = 600.0,
        threads: int | None = None,
        workshop: Workshop | None = None,
    ) -> None:
        self.peer, self.launch, self.scene, self.timeout, self.workshop = peer, launch, scene, timeout, workshop
        self.threads = threads or cores()
        self.version = ""
        """What the renderer says of itself; known when it has run."""
        self.spent = Spent()
        """By the last image."""

    def __enter__(self) -> PeerRenderer:
        if self.peer.gloss and self.scene.is_glossy:
            raise InputError("material", "glossy", f"a diffuse one by {self.peer.title}: {self.peer.gloss}")
        self._folder = tempfile.TemporaryDirectory(prefix="nusselt-peer-")
        self._description = Path(self._folder.name, "scene.npz")
        write_description(self._description, self.scene)
        return self

    def __exit__(self, *_: object) -> None:
        self._folder.cleanup()

    def run(self, samples: int, seed: int, options: Mapping[str, Any] | None = None) -> Run:
        """One image; ``options`` of the adapter leave what it would set.

        Raises
        ------
        ProgramFailed
            If it fails, takes too long, or writes no image of the scene.
        """
        started = time.perf_counter()
        try:
            raw = self._image({"samples": samples, "seed": seed, **(options or {})})
        except (ProgramFailed, ReferenceUnavailable) as problem:
            raise ProgramFailed(f"{self.peer.title}: {problem}") from problem
        except (OSError, KeyError, ValueError, zipfile.BadZipFile, InputError) as problem:
            raise ProgramFailed(f"{self.peer.title} ended well and gave no image: {problem}") from problem
        return Run(raw, seed, samples, time.perf_counter() - started)

    def _image(self, said: dict[str, Any]) -> Raw:
        output = Path(self._folder.name, "image.npz")
        output.unlink(missing_ok=True)
        words = [str(self._description), str(output), json.dumps({"threads": self.threads, **said})]
        if self.workshop:
            self.workshop.do(words, self.timeout)
        else:
            call([*self.launch, *words], self.timeout)
        with np.load(output) as arrays:
            image, self.version = arrays["image"], str(arrays["version"])
            self.spent = Spent(*arrays["spent"].tolist()) if "spent" in arrays else Spent()
        return raw_of(image, self.scene, self.peer.name)


class BridgeRenderer(PeerRenderer):
    """Mitsuba, in the bridge's child."""

    def __enter__(self) -> PeerRenderer:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def _image(self, said: dict[str, Any]) -> Raw:
        scene, sampler = with_pixel_rule(self.scene, self.peer.rule), said.get("sampler", "multijitter")
        (image,) = mitsuba_images(scene, said["samples"], [said["seed"]], sampler=sampler, timeout=self.timeout)
        self.version = f"Mitsuba {package_versions()['mitsuba']}"
        return raw_of(image.transpose(1, 2, 0), self.scene, self.peer.name)


def renderer_of(
    peer: Peer, launch: list[str], scene: Scene, timeout: float = 600.0, threads: int | None = None
) -> PeerRenderer:
    """A peer for one scene, whoever runs it."""
    kind = BridgeRenderer if peer.within else PeerRenderer
    return kind(peer, launch, scene, timeout, threads)


def prove(peer: Peer, launch: list[str]) -> str:
    """Render a few pixels, which packages that were installed may still not do; returns the renderer's version.

    Raises
    ------
    ProgramFailed
    """
    with renderer_of(peer, launch, load("quad").with_(width=8, height=6)) as renderer:
        renderer.run(1, 0)
        return renderer.version
