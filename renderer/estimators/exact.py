"""Light behind occluders without noise: boundary integrals over the visible contour.

Diffuse and glossy, for parallelograms and triangles. Lights without extent take one shadow ray. Big closed meshes are
taken by their silhouettes (`soft_shadows.meshes`), on diffuse surfaces and for parallelograms: what is claimed there is
consistency, and how far it goes is what each value's bound says. What it leaves to sampling, and then claims no
exactness for: lights that are neither behind blockers, triangles behind big meshes, both behind flat disks, round
bodies through a light's plane, points with more than MOST candidates, whose cost grows with the square, and lobes
without boundary integrals.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from nusselt.renderer.errors import InputError
from nusselt.renderer.lights import QuadLight
from nusselt.renderer.needs import Needs, Source
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.soft_shadows.convex.candidates import Standing
from nusselt.renderer.soft_shadows.convex.quad import QuadShadows
from nusselt.renderer.vectors import Floats

from .analytic import closed_form
from .control_variate import ControlVariate
from .protocol import Claim

MOST = 1024
"""Candidates of one point beyond which it is sampled."""
CLOSED_MOST = 256
"""The same where they are closed meshes, whose silhouettes are cheaper."""
SAMPLES = 1024
"""Samples of such a point, and of the sun behind blockers, if not more are asked for."""


@dataclass(frozen=True, kw_only=True)
class Exact:
    """Exact shadows; ``samples`` and ``stratified`` hold for what is left to sampling.

    Parameters
    ----------
    shortcuts : bool
        Leave out what cannot matter to a point. The image is the same to rounding without.
    """

    samples: int = 1
    stratified: bool = False
    shortcuts: bool = True
    name: ClassVar[str] = "exact"
    summary: ClassVar[str] = "boundary integrals over the visible contour: soft shadows without noise"
    shares_points: ClassVar[bool] = False

    def claim(self, needs: Needs) -> Claim:
        if self.is_random(needs):
            return "unbiased"
        return "consistent" if any(_by_silhouettes(source) for source in needs.sources) else "exact"

    def is_random(self, needs: Needs) -> bool:
        return any(_may_sample(source) for source in needs.sources)

    def sampled(self, needs: Needs) -> tuple[str, ...]:
        """Which lights are left to sampling because of big meshes before them, or of a lobe they meet, and why."""
        lobes = tuple(
            f"light {source.index + 1} is sampled: {_unknown(source)}" for source in needs.sources if _unknown(source)
        )
        return lobes + tuple(
            f"shadows of light {source.index + 1} are sampled: {_why_no_silhouettes(source)}"
            for source in needs.sources
            if source.blockers.hierarchy is not None and _may_sample(source) and not _unknown(source)
        )

    def __call__(self, points: ShadingPoints, source: Source, rng: np.random.Generator) -> Floats:
        return self.with_bounds(points, source, rng)[0]

    def with_bounds(
        self, points: ShadingPoints, source: Source, rng: np.random.Generator
    ) -> tuple[Floats, Floats, dict[str, int]]:
        """Radiance (3, n), bounds (n,) and how many of the points took which route; see `protocol.Bounded`.

        Raises
        ------
        InputError
            If shadow rays are to start elsewhere: the contour is that of the surface's own points.
        """
        if source.blockers.offset is not None and not source.blockers.none:
            raise InputError(
                "shadow origin", "mitsuba", f"another estimator than {self.name}, which traces no shadow rays"
            )
        n, quad = points.count, _square_of(source)
        if _unknown(source):
            return self._sampled(points, source, rng), np.full(n, np.inf), {"sampled": n}
        if _by_silhouettes(source):
            from nusselt.renderer.soft_shadows.meshes import mesh_radiance

            return *mesh_radiance(points, source), {"silhouette": n}
        if quad is not None and (not source.blockers.none or not self.shortcuts):
            if _too_large(source):
                return self._sampled(points, source, rng), np.full(n, np.inf), {"sampled": n}
            found = QuadShadows(points, source, quad, self.shortcuts, MOST).radiance()
            if found.sampled.size:
                found.radiance[:, found.sampled] = self._sampled(points.take(found.sampled), source, rng)
            return found.radiance, found.bound, found.tally.counts
        if source.blockers.none:
            return *closed_form(points, source), {"lit": n}
        if source.has_extent:
            return self._sampled(points, source, rng), np.full(n, np.inf), {"sampled": n}
        return self._sampled(points, source, rng), closed_form(points, source)[1], {"exact": n}

    def _sampled(self, points: ShadingPoints, source: Source, rng: np.random.Generator) -> Floats:
        if source.has_extent and self.samples < SAMPLES:
            return ControlVariate(samples=SAMPLES, stratified=True)(points, source, rng)
        return ControlVariate(samples=self.samples, stratified=self.stratified)(points, source, rng)


def _square_of(source: Source) -> QuadLight | None:
    """The parallelogram in whose square a light's shadows are found, if there is one."""
    return source.light.parallelogram() or source.light.half_of()


def _unknown(source: Source) -> str:
    """Which lobe has no integral over the light, or over what is left of it; empty if all have."""
    for kind in source.without_form:
        return f"{kind.title} has no closed form over a {source.light.kind} light"
    if _square_of(source) is not None and not source.blockers.none:
        for kind in source.without_contour:
            return f"{kind.title} has no boundary integrals"
    return ""


LARGEST = 20_000
"""Triangles before a light beyond which its pieces are not looked for."""

BODY = 4096
"""Triangles of closed meshes beyond which silhouettes are taken before pieces are looked for: more than MOST boxes."""


def _too_large(source: Source) -> bool:
    """Whether a light's contour is not looked for: what stands before it is too much, or a disk."""
    return source.blockers.triangles.size > LARGEST or source.blockers.disks.size > 0


def _many(source: Source, light: QuadLight, most: int) -> bool:
    """Whether some point may have more candidates, or awkward ones."""
    if _too_large(source):
        return True
    standing = Standing.before(light, source.blockers)
    return standing.pieces.size + standing.balls.size > most or bool(standing.round.awkward[standing.balls].any())


def _why_no_silhouettes(source: Source) -> str:
    """What keeps silhouettes from telling all of a light's shadows; without a big mesh none of their code is read."""
    if source.blockers.hierarchy is None:
        return "no big mesh stands before it"
    from nusselt.renderer.soft_shadows.meshes import why_not

    return why_not(source)


def _by_silhouettes(source: Source) -> bool:
    quad = source.light.parallelogram()
    if quad is None or _why_no_silhouettes(source):
        return False
    return source.blockers.triangles.size > BODY or _many(source, quad, CLOSED_MOST)


def _may_sample(source: Source) -> bool:
    if _unknown(source):
        return True
    if not source.has_extent or source.blockers.none:
        return False
    quad = _square_of(source)
    return quad is None or (bool(_why_no_silhouettes(source)) and _many(source, quad, MOST))
