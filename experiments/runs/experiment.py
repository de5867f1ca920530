"""What an experiment is: jobs that know nothing of each other, and figures made from what they found."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np

from nusselt.experiments.results.document import plain
from nusselt.experiments.results.schema import Row, check_row
from nusselt.experiments.scenes.catalogue import load
from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Floats

from .own import Own

Size = TypeVar("Size")
NONE_OWN = Own()


@dataclass(frozen=True)
class Settings:
    """What a user may say to every experiment.

    Parameters
    ----------
    quick : bool
        Small images and few samples: the same claims, less surely.
    seed : int
        Root of every job's seed.
    scenes : tuple of str
        Files or classic scenes instead of the experiment's own.
    tiny : bool
        Next to nothing, to see that all of it runs: no claim needs to hold.
    own : Own
        The user's estimators and renderers, beside the experiment's.
    long : bool
        Mitsuba's times measured to the end, where they are bounds otherwise.
    """

    quick: bool = False
    seed: int = 0
    scenes: tuple[str, ...] = ()
    tiny: bool = False
    own: Own = NONE_OWN
    long: bool = False

    def pick(self, whole: Size, quick: Size, tiny: Size) -> Size:
        """What suits the size that is asked for."""
        return tiny if self.tiny else quick if self.quick else whole

    def chosen(self, own: Sequence[str]) -> list[Scene]:
        """The user's scenes, or else the experiment's own."""
        return [load(name) for name in self.scenes or own]

    def seed_of(self, *names: object) -> int:
        """A seed that depends on the names but not on any order."""
        words = [zlib.crc32(str(name).encode()) for name in names]
        return int(np.random.SeedSequence([self.seed, *words]).generate_state(1)[0])


@dataclass(frozen=True)
class Outcome:
    """What a job found.

    Parameters
    ----------
    rows : list of dict
        What `plain` makes JSON types of, as `schema` says; each carries ``as_claimed``.
    arrays : dict
        Images and curves for the figures.
    """

    rows: list[Row]
    arrays: dict[str, Floats] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for number, row in enumerate(self.rows, start=1):
            check_row(plain(row), f"row {number}")


@dataclass(frozen=True)
class Job:
    """A pure function and what it is given: it can run anywhere, at any time, once.

    Parameters
    ----------
    function : callable
        Of module level; called with ``arguments``, gives an `Outcome`.
    arguments : dict
        JSON types, scenes and estimators; seeds among them.
    alone : bool
        Needs the machine to itself: it measures time, or runs Mitsuba, which takes every core.
    """

    function: Callable[..., Outcome]
    arguments: dict[str, Any]
    alone: bool = False


@dataclass(frozen=True)
class Experiment:
    """A question, put as data.

    Parameters
    ----------
    name, summary : str
        As the command line knows it, and one line.
    jobs : callable
        Settings to jobs.
    figures : callable
        Outcomes, in the order of the jobs, to matplotlib figures by name.
    scenes : tuple of str
        Classic scenes it looks at, or how many it makes; empty if it makes its own and they cannot be chosen.
    table : callable, optional
        Rows to a table for a terminal of so many columns, where the general one would not do.
    text : callable, optional
        Rows to a Markdown page.
    files : callable, optional
        Rows to further text files, by name.
    takes_own : bool
        Whether it looks at the user's estimators and renderers too.
    takes_long : bool
        Whether it can measure longer.
    """

    name: str
    summary: str
    jobs: Callable[[Settings], Sequence[Job]]
    figures: Callable[[Sequence[Outcome]], dict[str, Any]]
    scenes: tuple[str, ...] = ()
    table: Callable[[Sequence[Row], int], Any] | None = None
    text: Callable[[Sequence[Row]], str] | None = None
    files: Callable[[Sequence[Row]], dict[str, str]] | None = None
    takes_own: bool = False
    takes_long: bool = False
