"""Finished jobs on disk, each under a digest of all that could change its outcome."""

from __future__ import annotations

import hashlib
import json
from dataclasses import fields, is_dataclass
from decimal import Decimal
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from nusselt import experiments, mitsuba_bridge, renderer
from nusselt.experiments.files import replacing
from nusselt.experiments.results.document import package_versions, plain
from nusselt.renderer.scene import Scene

from .experiment import Job, Outcome

PACKAGES = (renderer, mitsuba_bridge, experiments)


@lru_cache(maxsize=1)
def code_digest() -> str:
    """SHA-256 of the project's own source and of the versions of what it uses."""
    told = hashlib.sha256(json.dumps(package_versions(), sort_keys=True).encode())
    for package in PACKAGES:
        (root,) = package.__path__
        for path in sorted(Path(root).rglob("*.py")):
            told.update(f"{package.__name__}/{path.relative_to(root).as_posix()}".encode())
            told.update(path.read_bytes())
    return told.hexdigest()


def _said(value: Any) -> Any:
    """An argument as JSON that tells it from every other."""
    if isinstance(value, Scene):
        return {"scene": value.name, "digest": value.digest()}
    if isinstance(value, dict):
        return {str(key): _said(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [_said(entry) for entry in value]
    if is_dataclass(value):
        return {"type": type(value).__qualname__} | {f.name: _said(getattr(value, f.name)) for f in fields(value)}
    if isinstance(value, Path | Decimal):
        return str(value)
    return plain(value)


def key(job: Job) -> str:
    """The digest under which a job's outcome is kept."""
    words = [job.function.__module__, job.function.__qualname__, _said(job.arguments), code_digest()]
    return hashlib.sha256(json.dumps(words, sort_keys=True).encode()).hexdigest()[:32]


class Store:
    """Outcomes in a folder; without a folder nothing is kept."""

    def __init__(self, folder: Path | None) -> None:
        self.folder = folder

    def get(self, job: Job) -> Outcome | None:
        """What was found before; None if it was not, or if what is there cannot be read."""
        if self.folder is None:
            return None
        name = key(job)
        try:
            rows = json.loads((self.folder / f"{name}.json").read_text(encoding="utf-8"))
            with np.load(self.folder / f"{name}.npz", allow_pickle=False) as archive:
                return Outcome(rows, {k: archive[k] for k in archive.files})
        except (OSError, ValueError, EOFError):
            return None

    def put(self, job: Job, outcome: Outcome) -> None:
        """Keep an outcome: the rows last, since they say that all is there."""
        if self.folder is None:
            return
        name = key(job)
        with replacing(self.folder / f"{name}.npz") as beside, beside.open("wb") as stream:
            np.savez_compressed(stream, allow_pickle=False, **outcome.arrays)
        with replacing(self.folder / f"{name}.json") as beside:
            beside.write_text(json.dumps(plain(outcome.rows), indent=1, allow_nan=False), encoding="utf-8")
