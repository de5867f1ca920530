"""What a peer is: another renderer, how it is had, and where it is not what a good guess takes it for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from nusselt.experiments.check.question import PixelRule

ADAPTERS = Path(__file__).parent / "adapters"


@dataclass(frozen=True)
class Setting:
    """A departure from what a renderer does if it is not asked, or from what a good guess would ask.

    Parameters
    ----------
    what : str
        In the renderer's own words.
    used, left : str
        What the adapter says; what happens without it.
    options : mapping
        Of the adapter, that leave it.
    """

    what: str
    used: str
    left: str
    options: Mapping[str, Any]


@dataclass(frozen=True)
class OnPath:
    """A program on the PATH that renders.

    Parameters
    ----------
    name : str
    source : str
        How it is had.
    script : tuple of str
        Words between the program and the adapter, of a program that is a Python itself; else ours runs the adapter.
    """

    name: str
    source: str
    script: tuple[str, ...] = ()


@dataclass(frozen=True)
class Peer:
    """A renderer that is not ours.

    Parameters
    ----------
    name, title, licence : str
    rule : {"centre", "area"}
        What a pixel of its image is.
    noise : bool
        Whether its image depends on a seed. Without, its error is its method's, and an image of a quarter of the
        samples is made too: the step between the two says how large it is.
    samples : int
        Light points of a pixel (where it is "centre"), or camera rays, unless asked otherwise.
    settings : tuple of Setting
    unequal : tuple of str
        What no setting puts right.
    packages : mapping
        Pinned, by the version of Python they are made for; "" for any. Empty where only a program does.
    program : OnPath, optional
        Does as well; or alone, where there are no packages.
    within : str
        The module of a renderer that our own environment has and the bridge runs, without an adapter; "": any other.
    gloss : str
        Why it cannot show Phong's lobe as ours is; "": it can.
    timed, beware : str
        What is taken for rendering; why its seconds are not to be held against another's without a thought.
    megabytes : int
        Of all that is installed, measured.
    """

    name: str
    title: str
    licence: str
    rule: PixelRule
    noise: bool
    samples: int
    settings: tuple[Setting, ...]
    unequal: tuple[str, ...]
    megabytes: int
    packages: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    program: OnPath | None = None
    within: str = ""
    gloss: str = ""
    timed: str = ""
    beware: str = ""

    @property
    def adapter(self) -> Path:
        """The script that speaks to it."""
        return ADAPTERS / f"run_{self.name}.py"
