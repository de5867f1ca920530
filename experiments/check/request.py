"""How a scene is read, and which options each way of checking it makes use of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike
from typing import Any

from nusselt.experiments.scenes.catalogue import load
from nusselt.experiments.scenes.sizes import at_width
from nusselt.mitsuba_bridge.own import read_mitsuba_dict
from nusselt.renderer.errors import InputError
from nusselt.renderer.scene import MAX_SIDE, Scene

from .question import PixelRule, whole_within, with_pixel_rule

SceneLike = str | PathLike[str] | Scene | Mapping[str, Any]


@dataclass(frozen=True)
class Reading:
    """How a scene is read.

    Parameters
    ----------
    lenient : bool
        Warn of unknown commands instead of refusing the scene.
    two_sided : bool
        Surfaces reflect at their back too.
    as_diffuse : bool
        Of other programs' files: put diffuse surfaces in the place of others.
    as_mesh : bool
        Of Mitsuba's: put meshes in the place of cylinders.
    """

    lenient: bool = False
    two_sided: bool = False
    as_diffuse: bool = False
    as_mesh: bool = False

    def scene(self, given: SceneLike, rule: PixelRule | None = None) -> Scene:
        """A scene by file name, a classic one by its name, what `mi.load_dict` takes, or the scene itself.

        Raises
        ------
        InputError
            If it cannot be read.
        """
        if isinstance(given, Scene):
            scene = given
        elif isinstance(given, Mapping):
            scene = read_mitsuba_dict(given, as_diffuse=self.as_diffuse, as_mesh=self.as_mesh)
        elif isinstance(given, str | PathLike):
            scene = load(str(given), self.lenient, self.as_diffuse, self.as_mesh)
        else:
            accepted = "a scene file, the name of a classic scene, a dict as Mitsuba takes it, or a Scene"
            raise InputError("scene", given, accepted)
        return with_pixel_rule(scene.with_(two_sided=self.two_sided or scene.two_sided), rule)


@dataclass(frozen=True)
class SizedReading(Reading):
    """The same in other numbers of pixels.

    Parameters
    ----------
    width : int or None
        Pixels across, of the same shape, 1 to 65,536; None: the scene's.
    """

    width: int | None = None

    def scene(self, given: SceneLike, rule: PixelRule | None = None) -> Scene:
        """As `Reading.scene`."""
        if self.width is not None:
            whole_within("width", self.width, 1, MAX_SIDE)
        return at_width(super().scene(given, rule), self.width)


@dataclass(frozen=True)
class Mode:
    """A way of checking, and the options it makes use of.

    Parameters
    ----------
    what : str
        In the user's words.
    options : frozenset of str
    """

    what: str
    options: frozenset[str]

    def refuse_others(self, said: Mapping[str, object]) -> None:
        """Refuse what was said and would not be used.

        Raises
        ------
        InputError
        """
        for name, value in said.items():
            if name not in self.options:
                raise InputError(name, value, f"it left out: a check of {self.what} makes no use of it")


_ALL = frozenset(
    (
        *(
            "scenes",
            "estimator",
            "samples",
            "stratified",
            "seed",
            "lenient",
            "two_sided",
            "as_diffuse",
            "as_mesh",
            "width",
            "pixel_rule",
            "margin",
        ),
        *("alpha", "timeout", "cluster", "out", "target", "csv", "junit", "summary"),
    )
)
_KEPT = frozenset(("reference", "cache"))
_OURS = _ALL | {"classic", "shadow_origin", "tolerance", "verbose"}
_LEVELS = frozenset(("transfer", "quantisation", "noise"))
_RUNS = frozenset(("renderer", "runs", "steps"))

OURS = Mode("our image", _OURS | _KEPT)
UNTIL_DECIDED = Mode("our image until decided", _OURS | {"until_decided", "budget", "tev"})
IMAGES = Mode("images", _ALL | _KEPT | _LEVELS | {"images"})
FUNCTION = Mode("a function's images", _ALL | _KEPT | _LEVELS | _RUNS)
PROGRAM = Mode("a program's images", FUNCTION.options | {"image_type", "run_timeout"})
MODES = (OURS, UNTIL_DECIDED, IMAGES, FUNCTION, PROGRAM)


def mode_of(images: bool, renderer: object, until_decided: bool = False) -> Mode:
    """The way of checking that was asked for.

    Raises
    ------
    InputError
        If it is two of them.
    """
    if images and renderer is not None:
        raise InputError("renderer", renderer, "images or a renderer, not both")
    if renderer is not None:
        return PROGRAM if isinstance(renderer, str) else FUNCTION
    return IMAGES if images else UNTIL_DECIDED if until_decided else OURS
