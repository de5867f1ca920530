"""A cross-check as it is asked for: who is there, their images, the comparison, what settings left cost."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import partial

from nusselt.experiments.check.check import Progress
from nusselt.experiments.check.question import PixelRule
from nusselt.experiments.external.program import Program, ProgramFailed, ProgramRenderer
from nusselt.experiments.images.read import read_image
from nusselt.experiments.results.store import Store
from nusselt.renderer.errors import InputError
from nusselt.renderer.scene import Scene

from .cross import Cross, CrossQuestion, cross_check
from .departures import Departure, departures
from .entrant import Effort, Entrant, of_images, of_peer, of_renderer
from .environment import Environments
from .peer import Peer
from .renderer import PeerRenderer, renderer_of
from .times.measure import Times, measure, sides_of, truths_of

YOURS = "yours"
NOWHERE = Store(None)


@dataclass(frozen=True)
class Brought:
    """What a user brings beside the peers.

    Parameters
    ----------
    images : tuple of str
        Files, one renderer's, of different seeds.
    program : Program, optional
    rule : {"centre", "area"}
        What its pixels are.
    samples : int
        Asked of the program.
    """

    images: tuple[str, ...] = ()
    program: Program | None = None
    rule: PixelRule = "centre"
    samples: int = 64


@dataclass(frozen=True)
class Task:
    """What is compared, and how.

    Parameters
    ----------
    peers : tuple of Peer
    environments : Environments
    effort : Effort
    brought : Brought
    question : CrossQuestion
    measure_departures : bool
    measure_times : bool
    laps : Store
        Where laps are kept, and found again.
    timeout : float
        Seconds of one image.
    """

    peers: tuple[Peer, ...]
    environments: Environments
    effort: Effort
    brought: Brought
    question: CrossQuestion
    measure_departures: bool = False
    measure_times: bool = False
    laps: Store = NOWHERE
    timeout: float = 600.0

    def runs(self) -> int:
        """Images of peers of one scene, for telling how far it is."""
        seeds = [self.effort.seeds if peer.noise else 2 for peer in self.peers]
        left = [
            len(peer.settings) * min(n, 2) if self.measure_departures else 0
            for n, peer in zip(seeds, self.peers, strict=True)
        ]
        return sum(seeds) + sum(left)


def run_cross(
    scene: Scene, file: str | None, task: Task, executor: Executor | None = None, progress: Progress | None = None
) -> Cross:
    """Cross-check one scene; what is missing or fails is named, and the others compared.

    Parameters
    ----------
    file : str, optional
        The scene's own, for a program of the user's; else it is given one of ours.

    Raises
    ------
    InputError
        If nothing is there to compare.
    """
    entrants, missing, done = _brought(scene, file, task), {}, 0

    def tell() -> None:
        nonlocal done
        done += 1
        if progress:
            progress("peers", done, task.runs())

    with ExitStack() as stack:
        ready: list[PeerRenderer] = []
        for peer in task.peers:
            launch = task.environments.launch(peer)
            if launch is None:
                missing[peer.name] = f"not installed: {task.environments.status(peer)}"
                continue
            try:
                renderer = stack.enter_context(renderer_of(peer, launch, scene, task.timeout))
                entrants.append(of_peer(renderer, task.effort, tell))
                ready.append(renderer)
            except (ProgramFailed, InputError) as problem:
                missing[peer.name] = str(problem)
        if not entrants:
            told = "; ".join(f"{peer} is {why}" for peer, why in missing.items())
            accepted = "one at least that is installed, a --renderer or images"
            raise InputError("peers", ", ".join(missing) or "none", f"{accepted}{told and f' ({told})'}")
        found = cross_check(scene, entrants, task.question, executor, progress)
        left = _departures(ready, found, task, tell) if task.measure_departures else ()
        times = _times(ready, found, task, executor, progress) if task.measure_times else None
    return replace(found, missing=missing, departures=left, times=times)


def _departures(
    ready: Sequence[PeerRenderer], found: Cross, task: Task, tell: Callable[[], None]
) -> tuple[Departure, ...]:
    measure = partial(departures, arbiter=found.arbiter, effort=task.effort, margin=task.question.margin, tell=tell)
    return tuple(one for renderer in ready for one in measure(renderer))


def _times(
    ready: Sequence[PeerRenderer], found: Cross, task: Task, executor: Executor | None, progress: Progress | None
) -> Times:
    def tell(done: int, total: int) -> None:
        if progress:
            progress("times", done, total)

    scene = found.scene
    truths = truths_of(scene, found.arbiter.shaded, executor)
    with ExitStack() as stack:
        sides = sides_of(scene, truths, ready, stack)
        return measure(scene, sides, task.effort.seeds, task.effort.seed, task.laps, tell)


def _brought(scene: Scene, file: str | None, task: Task) -> list[Entrant]:
    """The user's own, first."""
    brought, found = task.brought, []
    if brought.images:
        raws = [read_image(image, scene) for image in brought.images]
        found.append(of_images(YOURS, raws, brought.rule, {"title": ", ".join(brought.images)}))
    if brought.program is not None:
        with ProgramRenderer(brought.program, scene, file) as renderer:
            made = of_renderer("your renderer", renderer, brought.rule, brought.samples, task.effort)
        found.append(replace(made, about=dict(made.about) | {"title": brought.program.command}))
    return found
