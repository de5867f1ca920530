"""What every kind of lobe answers, and the shading points that carry its columns.

A surface's BRDF is a sum of lobes, each an albedo times a function of two directions. A kind of lobe is one frozen,
validated dataclass in a file of this folder, listed in `LOBES`, and its half in ``mitsuba_bridge/lobes.py``. To add a
kind, write its file (a `SampledLobe` needs its parameters and `evaluate` alone), list it in ``__init__.py``, and add a
surface to the bridge; `check_kind` and ``tests/test_lobes.py`` hold it to this page.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, ClassVar, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from nusselt.renderer.closed_forms.circles.circles import CircleArcs
from nusselt.renderer.validation import Vec3
from nusselt.renderer.vectors import Bools, Floats, Ints

Estimate: TypeAlias = tuple[Floats, Floats]
"""A value and a bound of its error."""
Columns: TypeAlias = Mapping[str, Floats]
"""What surfaces or points have of every parameter, by its name: (3, n) for an albedo, (n,) for a number."""


@dataclass(frozen=True)
class Parameter:
    """A parameter of a kind: one field of its dataclass.

    Parameters
    ----------
    name : str
        Its command in the scene text, its column, and what errors call it: no two kinds share one.
    arguments : str
        The names of its numbers: ``r g b`` for an albedo, one word for a number.
    """

    name: str
    arguments: str

    @property
    def is_colour(self) -> bool:
        return len(self.arguments.split()) == 3


class Contour(Protocol):
    """A lobe's boundary integrals, for shadows without noise and for disks: all of them times 2 pi, without albedo."""

    dear: ClassVar[bool]
    """Whether an arc costs more than to look which arcs are needed."""

    def arcs(self, points: ShadingPoints, index: Ints, start: Floats, end: Floats) -> Estimate:
        """Shares (k,) of great-circle arcs from start to end (3, k), seen from the points ``index`` (k,)."""

    def circles(self, points: ShadingPoints, arcs: CircleArcs) -> Estimate:
        """Shares (k,) of arcs of circle cones, each of which names its point."""

    def density(self, points: ShadingPoints, index: Ints) -> Callable[[Floats, Floats], Floats | float]:
        """The lobe as a function of ways (3, k) from the points ``index`` (k,) and their squared lengths (k,)."""

    def peak(self, points: ShadingPoints) -> Floats | float:
        """The largest value of that, (n,)."""

    def is_smooth(self, points: ShadingPoints, middle: Floats, distance: Floats, spread: Floats) -> Bools | bool:
        """Whether six nodes each way integrate it over a light of half angle ``spread`` (n,) about a way (3, n)."""


PatchForm: TypeAlias = Callable[["ShadingPoints", Ints, Floats, Floats, Floats], Estimate]
"""Integral (k,) at the points ``index`` (k,), ascending, without albedo, over the parallelogram corner + u ab + v ac,
both of whose sides count; and a bound of its relative error. The vectors are (3, 1) or (3, n)."""


class Lobe(Protocol):
    """A kind of lobe; an instance is that of one surface. Its fields are its parameters, the albedo first.

    Every field has a default, and that of the albedo is black.
    """

    kind: ClassVar[str]
    title: ClassVar[str]
    """What reports call it: a noun phrase."""
    glossy: ClassVar[bool]
    """Whether a scene that has none of it is spared its evaluation: all but Lambert's."""
    PARAMETERS: ClassVar[tuple[Parameter, ...]]
    """Of each field, in order."""
    patch: ClassVar[PatchForm | None]
    """Its closed form over a parallelogram, if it has one: else it is sampled there, and the route says so."""
    contour: ClassVar[Contour | None]
    """Its boundary integrals, if it has any: else it is sampled behind blockers and over disks."""

    @property
    def albedo(self) -> Vec3:
        """Dimensionless, none negative."""

    @classmethod
    def evaluate(cls, points: ShadingPoints, d: Floats, length: Floats) -> Floats:
        """The lobe without its albedo, 1/sr, (n, k), along ways d (3, n, k) of the given length (n, k)."""

    @classmethod
    def over_beams(cls, points: ShadingPoints, arriving: Floats, d: Floats, length: Floats) -> Floats:
        """The sum (n,) of it along beams of which so much irradiance (n, k) arrives."""

    @classmethod
    def steepness(cls, points: ShadingPoints) -> Floats | float:
        """The power (n,) of a cosine that falls as steeply: what rounding and quadrature are bounded by.

        Above the horizons of the normal and of the mirror direction it is smooth; if not, infinity.
        """


class SampledLobe:
    """What a lobe answers that is a function and nothing more: no closed form, and nothing of its shape known."""

    glossy: ClassVar[bool] = True
    patch: ClassVar[PatchForm | None] = None
    contour: ClassVar[Contour | None] = None
    evaluate: ClassVar[Callable[..., Floats]]

    @classmethod
    def over_beams(cls, points: ShadingPoints, arriving: Floats, d: Floats, length: Floats) -> Floats:
        return np.asarray((arriving * cls.evaluate(points, d, length)).sum(axis=1))

    @classmethod
    def steepness(cls, points: ShadingPoints) -> Floats | float:
        return np.inf


SHARE = 1e-4
"""Of an image's tolerance, that closed forms may err by."""


@dataclass(frozen=True, eq=False)
class ShadingPoints:
    """Points whose front the camera sees.

    Parameters
    ----------
    position, normal, outgoing, mirror : (3, n) float64
        Point; unit normal on the viewer's side; unit direction to the viewer; its mirror image.
    lobes : tuple of kinds of lobe
        That some surface of the scene has.
    columns : mapping
        Their parameters at the points.
    ellipsoid : (n,) int64
        Ellipsoid on whose outside the point lies, so that nothing of it is above its horizon; -1 for none, and for
        points on the inside of one.
    outside : (n,) bool
        Whether it is known to lie on the front of one of the hierarchy's triangles (see `segments`), with nothing of
        them around it: seen from beyond their bounding box.
    enough : float
        What an error bound of a closed form may be, so that no dearer form is asked, in units of what the light would
        give if it and the point faced each other; 0: as small as it gets.
    """

    position: Floats
    normal: Floats
    outgoing: Floats
    mirror: Floats
    lobes: tuple[type[Lobe], ...]
    columns: Columns
    ellipsoid: Ints
    outside: NDArray[np.bool_]
    enough: float = 0.0

    @property
    def count(self) -> int:
        return self.position.shape[1]

    @property
    def diffuse(self) -> Floats:
        """Lambert's albedo, (3, n)."""
        return self.columns["diffuse"]

    @property
    def specular(self) -> Floats:
        """The Phong lobe's albedo, (3, n)."""
        return self.columns["specular"]

    @property
    def shininess(self) -> Floats:
        """Phong exponents, (n,)."""
        return self.columns["shininess"]

    def albedo(self, kind: type[Lobe]) -> Floats:
        """The albedo (3, n) of one of the lobes."""
        return self.columns[kind.PARAMETERS[0].name]

    def reflecting(self, glossy: bool) -> tuple[type[Lobe], ...]:
        """The lobes that are to be evaluated: unless ``glossy``, Lambert's alone."""
        return self.lobes if glossy else tuple(kind for kind in self.lobes if not kind.glossy)

    @property
    def is_glossy(self) -> bool:
        return any(kind.glossy and self.albedo(kind).any() for kind in self.lobes)

    def take(self, index: Ints) -> ShadingPoints:
        """The points ``index`` (k,)."""
        return self._each(lambda v: v.take(index, axis=-1))  # rows stay rows in memory

    def repeated(self, times: int) -> ShadingPoints:
        """Each point so many times, one after the other."""
        return self._each(lambda v: np.repeat(v, times, axis=-1))

    def as_exact_as(self, tolerance: float) -> ShadingPoints:
        """The same points, for an image of that tolerance: closed forms err by much less than what is seen of it."""
        return replace(self, enough=SHARE * tolerance)

    @property
    def tolerance(self) -> float:
        """Of that image; 0 where none was asked."""
        return self.enough / SHARE

    def with_columns(self, **changed: Floats) -> ShadingPoints:
        """The same points with other columns."""
        return replace(self, columns={**self.columns, **changed})

    def _each(self, change: Callable[[Any], Any]) -> ShadingPoints:
        return ShadingPoints(
            change(self.position),
            change(self.normal),
            change(self.outgoing),
            change(self.mirror),
            self.lobes,
            {name: change(v) for name, v in self.columns.items()},
            change(self.ellipsoid),
            change(self.outside),
            self.enough,
        )


def joined(parts: Sequence[ShadingPoints]) -> ShadingPoints:
    """Points of one scene, at least one part, one after the other."""

    def along(name: str) -> Any:
        return np.concatenate([getattr(part, name) for part in parts], axis=-1)

    columns = {name: np.concatenate([part.columns[name] for part in parts], axis=-1) for name in parts[0].columns}
    names = [entry.name for entry in fields(ShadingPoints) if entry.name not in ("lobes", "columns", "enough")]
    return replace(parts[0], columns=columns, **{name: along(name) for name in names})


def values_of(lobe: Any) -> dict[str, Vec3 | float]:
    """A lobe's parameters by their names."""
    return {
        parameter.name: getattr(lobe, entry.name)
        for parameter, entry in zip(lobe.PARAMETERS, fields(lobe), strict=True)
    }


def from_values(kind: type[Lobe], values: Mapping[str, Any]) -> Lobe:
    """The lobe of a kind that has those of the named values that are its parameters; else its defaults."""
    names = {parameter.name: entry.name for parameter, entry in zip(kind.PARAMETERS, fields(kind), strict=True)}  # type: ignore[arg-type]
    return kind(**{names[name]: value for name, value in values.items() if name in names})


def check_kind(kind: Any) -> None:
    """Raise a TypeError if a kind does not answer all of `Lobe`."""
    missing = [name for name in ANSWERS if not hasattr(kind, name)]
    if missing:
        raise TypeError(f"{getattr(kind, '__name__', kind)} is no kind of lobe: it lacks {', '.join(missing)}")


ANSWERS = tuple(sorted({name for name in (*vars(Lobe), *Lobe.__annotations__) if not name.startswith("_")}))
