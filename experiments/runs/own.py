"""A user's own estimators and renderers, beside those that a study looks at."""

from __future__ import annotations

import hashlib
import shlex
import shutil
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from nusselt.experiments.check.estimators import imported_estimator
from nusselt.experiments.external.program import Program, ProgramFailed, ProgramRenderer
from nusselt.experiments.images.read import quantiser_of
from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import ESTIMATORS, Estimator
from nusselt.renderer.image import render
from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Floats

LOOK = 12
"""Pixels a side of the image by which it is found out whether strata make a difference."""


@dataclass(frozen=True)
class OwnEstimator:
    """An estimator of the user's.

    Parameters
    ----------
    path : str
        ``package.module:Name``.
    digest : str
        Of its source: jobs are done again when it changes.
    """

    path: str
    digest: str

    @property
    def kind(self) -> type[Estimator]:
        """The class."""
        return imported_estimator(self.path)

    @property
    def name(self) -> str:
        """As rows and figures call it."""
        return self.kind.name

    def ways(self, scene: Scene) -> dict[str, Callable[[int], Estimator]]:
        """Number of samples to estimator, by name: random, and in strata where those make a difference."""
        kind = self.kind
        found: dict[str, Callable[[int], Estimator]] = {kind.name: lambda samples: kind(samples=samples)}
        small = scene.with_(width=LOOK, height=LOOK)
        plain, strata = (render(small, kind(samples=4, stratified=way)).mean for way in (False, True))
        if not np.array_equal(plain, strata):
            found[f"{kind.name} stratified"] = lambda samples: kind(samples=samples, stratified=True)
        return found


@dataclass(frozen=True)
class OwnRenderer:
    """A program of the user's that renders.

    Parameters
    ----------
    command : str
        As for ``nusselt check --renderer``.
    digest : str
        Of the files that its words name: jobs are done again when one of them changes.
    name : str
        As rows and figures call it.
    """

    command: str
    digest: str
    name: str

    @contextmanager
    def opened(self, scene: Scene) -> Iterator[Callable[[int, int], tuple[Floats, float]]]:
        """What renders a scene: (samples, seed) to radiance (3, h, w) and seconds."""
        with ProgramRenderer(Program(self.command), scene) as ready:

            def image(samples: int, seed: int) -> tuple[Floats, float]:
                try:
                    run = ready.run(samples, seed)
                except (InputError, ProgramFailed) as problem:
                    raise InputError("with_renderer", self.command, f"a program that works: {problem}") from problem
                return quantiser_of([run.raw], "linear", "auto").decode(run.raw), run.seconds

            yield image


@dataclass(frozen=True)
class Own:
    """All of them."""

    estimators: tuple[OwnEstimator, ...] = ()
    renderers: tuple[OwnRenderer, ...] = ()

    @property
    def words(self) -> list[str]:
        """As the command line has them."""
        told = [word for one in self.estimators for word in ("--with", one.path)]
        return told + [word for one in self.renderers for word in ("--with-renderer", one.command)]


def own_of(paths: Sequence[str], commands: Sequence[str]) -> Own:
    """Estimators by their paths, renderers by their commands.

    Raises
    ------
    InputError
        If one cannot be had, or has the name of another.
    """
    taken = {kind.name for kind in ESTIMATORS}
    estimators = []
    for path in dict.fromkeys(paths):
        with _called("with_estimator"):
            kind = imported_estimator(path)
        if kind.name in taken:
            raise InputError("with_estimator", path, f"an estimator with a name of its own, not {kind.name!r}")
        taken.add(kind.name)
        estimators.append(OwnEstimator(path, _digest(_sources(kind.__module__))))
    renderers = []
    for number, command in enumerate(dict.fromkeys(commands), start=1):
        with _called("with_renderer"):
            Program(command)
        name = "own renderer" if number == 1 else f"own renderer {number}"
        renderers.append(OwnRenderer(command, _digest(_named_files(command)), name))
    return Own(tuple(estimators), tuple(renderers))


@contextmanager
def _called(argument: str) -> Iterator[None]:
    """An error under the name by which the user gave it."""
    try:
        yield
    except InputError as error:
        raise InputError(argument, error.value, error.accepted) from error


def _sources(module: str) -> set[Path]:
    """The source of a module, and of what is loaded from its package, or from beside it."""
    top = sys.modules.get(module.partition(".")[0])
    file = getattr(top, "__file__", None) or getattr(sys.modules[module], "__file__", None)
    if file is None:
        return set()
    folder = Path(file).parent
    loaded = {Path(name) for one in list(sys.modules.values()) if (name := getattr(one, "__file__", None))}
    return {path for path in loaded if path.suffix == ".py" and folder in path.parents}


def _named_files(command: str) -> set[Path]:
    words = shlex.split(command)
    program = shutil.which(words[0])
    return {path for path in (*map(Path, words[1:]), *([Path(program)] if program else [])) if path.is_file()}


def _digest(paths: set[Path]) -> str:
    told = hashlib.sha256()
    for path in sorted(paths):
        told.update(str(path).encode())
        told.update(path.read_bytes())
    return told.hexdigest()
