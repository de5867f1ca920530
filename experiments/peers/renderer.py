"""A peer, ready for one scene: a renderer as `external.program.Renderer` has it."""

from __future__ import annotations

import json
import tempfile
import time
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from nusselt.experiments.external.program import ProgramFailed, Run, call
from nusselt.experiments.images.read import raw_of
from nusselt.renderer.errors import InputError
from nusselt.renderer.scene import Scene

from .description import write_description
from .peer import Peer


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
    """

    def __init__(self, peer: Peer, launch: list[str], scene: Scene, timeout: float = 600.0) -> None:
        self.peer, self.launch, self.scene, self.timeout = peer, launch, scene, timeout
        self.version = ""
        """What the renderer says of itself; known when it has run."""

    def __enter__(self) -> PeerRenderer:
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
        output = Path(self._folder.name, "image.npz")
        output.unlink(missing_ok=True)
        said = json.dumps({"samples": samples, "seed": seed, **(options or {})})
        started = time.perf_counter()
        try:
            call([*self.launch, str(self._description), str(output), said], self.timeout)
            seconds = time.perf_counter() - started
            with np.load(output) as arrays:
                image, self.version = arrays["image"], str(arrays["version"])
            raw = raw_of(image, self.scene, self.peer.name)
        except ProgramFailed as problem:
            raise ProgramFailed(f"{self.peer.title}: {problem}") from problem
        except (OSError, KeyError, ValueError, zipfile.BadZipFile, InputError) as problem:
            raise ProgramFailed(f"{self.peer.title} ended well and gave no image: {problem}") from problem
        return Run(raw, seed, samples, seconds)
