"""What every kind of light answers.

A kind is one frozen, validated dataclass in a file of this folder, listed in `LIGHTS`, and its half in
``mitsuba_bridge/lights.py``. Nothing else in the project asks what kind a light is, but for what is a closed form of
parallelograms: those ask for `Light.parallelogram`. To add a kind, write its file (``point.py`` is the shortest), list
it in ``__init__.py``, and register it in the bridge; `check_kind` and ``tests/test_lights.py`` hold it to this page.
"""

from __future__ import annotations

from typing import Any, ClassVar, Protocol

from nusselt.renderer.lobes import Lobe
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.validation import Vec3
from nusselt.renderer.vectors import Bools, Floats

from .body import Body, Plane
from .quad import QuadLight
from .text import Text


class Light(Protocol):
    """A kind of light. "Place" is a point of it, or a direction to it where it is ``at_infinity``."""

    kind: ClassVar[str]
    """What reports call it."""
    has_extent: ClassVar[bool]
    """Whether it is to be sampled: shadows are soft."""
    at_infinity: ClassVar[bool]
    """Whether shadow rays have no far end."""
    surrounds: ClassVar[bool]
    """Whether it is seen where no surface is."""
    TEXT: ClassVar[Text]
    """Its command in the scene text."""

    @property
    def colour(self) -> Vec3:
        """Radiance, intensity or irradiance: what the weights of beams multiply."""

    def with_colour(self, rgb: Vec3) -> Light:
        """The same light of another colour."""

    @property
    def hides_itself(self) -> bool:
        """Whether its body may stand between points and its own front: a round, flat or convex one does not."""

    @property
    def area(self) -> float:
        """Of its surface, in square scene units; 0 where it has none."""

    def beams(self, points: Floats, u: Floats, v: Floats) -> tuple[Floats, Floats]:
        """Ways to places of the light, and what each is worth.

        Parameters
        ----------
        points : (3, n) float64
        u, v : (n, k) or (1, k) float64
            Of the unit square. A light without extent gives one beam, whatever they are.

        Returns
        -------
        d : (3, n, k) float64
            From point to light point, or unit directions; may be read-only.
        weight : (n, k) float64
            Times the colour: radiance times solid angle, divided by k; 0 where the light turns its back. Writable.
        """

    def solid_beams(self, points: Floats, u: Floats, v: Floats) -> tuple[Floats, Floats]:
        """The same of density one over the solid angle that a point sees, for kinds that can; else `beams`."""

    def worth(self, points: Floats, d: Floats) -> Floats:
        """What single beams along d (3, n, k) from points (3, n) are worth, (n, k): the weight of `beams` for k = 1."""

    def at(self, u: float, v: float) -> Floats | None:
        """The place (3, 1) that a beam through (u, v) goes to; None if each point has one of its own."""

    def hull(self) -> Floats:
        """Places (3, m) whose convex hull holds the light."""

    def middle(self) -> tuple[Floats, float]:
        """The place (3, 1) in the middle, and the light's radius about it; at infinity, its half angle's tangent."""

    def body(self) -> Body | None:
        """What cameras see and shadow rays meet: black as a reflector, its front the emitting side. None: nothing."""

    def plane(self) -> Plane | None:
        """The plane it shines from, to the normal's side alone; None if it shines to all sides."""

    def unshadowed(self, points: ShadingPoints, glossy: bool) -> tuple[Floats, Floats]:
        """Reflected radiance (3, n) if nothing blocked, noise-free, and a bound (n,) of its relative error."""

    def has_form(self, kind: type[Lobe]) -> bool:
        """Whether `unshadowed` knows a kind of lobe: it raises an InputError for points with another."""

    def parallelogram(self) -> QuadLight | None:
        """The light as a parallelogram, if it is one: then `Exact` takes its shadows from the visible contour.

        Other lights with an extent are sampled behind blockers, and the route says so, but for `half_of`.
        """

    def half_of(self) -> QuadLight | None:
        """The parallelogram corner + u ab + v ac of which the light is the half u + v < 1, if it is one.

        Then `Exact` takes its shadows from the visible contour too, but for those of big meshes.
        """

    def rim_within(self, points: Floats, radius: Floats) -> Bools:
        """Whether its light ends, or begins to, by itself somewhere in balls (n,) about points (3, n)."""

    def without_rim(self) -> Light:
        """A light as bright where it is brightest, and of no rim."""

    def anchored(self) -> Floats:
        """The coordinates (3, m) that `moved` moves: none at infinity."""

    def moved(self, origin: Floats) -> Light:
        """The same light, seen from another origin (3,)."""

    def __hash__(self) -> int:
        """Equal lights are one: what is made of a light can be kept."""


def check_kind(kind: Any) -> None:
    """Raise a TypeError if a kind does not answer all of `Light`."""
    missing = [name for name in ANSWERS if not hasattr(kind, name)]
    if missing:
        raise TypeError(f"{kind.__name__} is no kind of light: it lacks {', '.join(missing)}")


ANSWERS = tuple(sorted({name for name in (*vars(Light), *Light.__annotations__) if not name.startswith("_")}))
