"""Finished jobs on disk, each under a digest of all that could change its outcome."""

from __future__ import annotations

import hashlib
from functools import lru_cache
from pathlib import Path

from nusselt import experiments, mitsuba_bridge, renderer
from nusselt.experiments.results.store import Store, key_of

from .experiment import Job, Outcome

PACKAGES = (renderer, mitsuba_bridge, experiments)


@lru_cache(maxsize=1)
def code_digest() -> str:
    """SHA-256 of the project's own source."""
    told = hashlib.sha256()
    for package in PACKAGES:
        (root,) = package.__path__
        for path in sorted(Path(root).rglob("*.py")):
            told.update(f"{package.__name__}/{path.relative_to(root).as_posix()}".encode())
            told.update(path.read_bytes())
    return told.hexdigest()


def key(job: Job) -> str:
    """The digest under which a job's outcome is kept."""
    return key_of(job.function.__module__, job.function.__qualname__, job.arguments, code_digest())


def finished(store: Store, job: Job) -> Outcome | None:
    """What a job found before; None if it did not, or if what is there cannot be read."""
    return store.find(key(job), lambda words, arrays: Outcome(words["rows"], arrays))


def finish(store: Store, job: Job, outcome: Outcome) -> None:
    """Keep an outcome."""
    store.keep(key(job), {"rows": outcome.rows}, outcome.arrays)
