"""Mistakes in the light: each is the scene rendered under one wrong rule."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from .case import Case, Guess
from .rules import RIGHT

MOST_KEPT = 0.95
NOISIER = 5.0
"""Times the usual noise that lost samples leave, at least."""
ALIKE = 0.4
"""Correlation of neighbours below which a difference is noise."""


def _under(case: Case, detail: str, **changes: object) -> Guess:
    return Guess(case.probe.radiance(replace(RIGHT, **changes)), detail)  # type: ignore[arg-type]


def missing_cosine(case: Case) -> Iterator[Guess]:
    """No cosine at the surface."""
    yield _under(case, "the cosine at the surface is missing", surface_cosine=False)


def missing_light_cosine(case: Case) -> Iterator[Guess]:
    """No cosine at the light."""
    if case.probe.one_sided:
        yield _under(case, "the cosine at the light is missing", facing="all")


def wrong_falloff(case: Case) -> Iterator[Guess]:
    """Another power of the distance."""
    yield _under(case, "divided by the distance, not by its square", falloff=1)
    yield _under(case, "not divided by the distance", falloff=0)


def two_sided_light(case: Case) -> Iterator[Guess]:
    """Lights that shine to both sides, whether or not they are seen so."""
    if case.probe.one_sided:
        both = _under(case, "lights emit on both sides", facing="both")
        yield both
        sight = case.probe.sight
        yield Guess(both.prediction - sight.glow + sight.emission, "lights light on both sides, their backs seen black")


def light_flipped(case: Case) -> Iterator[Guess]:
    """Lights that shine to the other side, whether or not they are seen so."""
    if case.probe.one_sided:
        flipped = _under(case, "lights emit on their back", facing="back")
        yield flipped
        sight = case.probe.sight
        yield Guess(
            flipped.prediction + sight.glow - 2 * sight.emission + sight.emission * (sight.light < 0),
            "lights emit on their back, and are seen so",
        )


def forgotten_light(case: Case) -> Iterator[Guess]:
    """Each light left out, each light alone; seen or not."""
    probe = case.probe
    every = tuple(range(len(probe.paths)))
    sets: dict[str, tuple[int, ...]] = {f"light {k + 1} of {len(every)} lights nothing": (k,) for k in every}
    if len(every) > 2:
        sets |= {f"light {k + 1} of {len(every)} alone lights": tuple(j for j in every if j != k) for k in every}
    for told, without in sets.items():
        guess = _under(case, told, without=without)
        yield guess
        unseen = np.isin(probe.sight.light, without)
        if (probe.sight.emission[:, unseen] > 0).any():
            yield Guess(np.where(unseen, 0.0, guess.prediction), told + ", and is not seen")
    if probe.sight.emission.any():
        yield Guess(probe.truth - probe.sight.emission, "no light is seen directly")


def light_self_shadow(case: Case) -> Iterator[Guess]:
    """Samples lost by rounding where shadow rays end; or all that have something behind the light.

    Which samples are lost hangs on a program's order of operations, and is as good as chance. Their share is fitted;
    what tells it from a plain factor is what it leaves: far more noise than the samples have, and nothing but noise.
    """
    yield _under(case, "shadow rays do not end at the light: what is behind it blocks", visibility="beyond")
    probe = case.probe
    seen = probe.sight.emission
    lit = probe.truth - seen
    if not probe.one_sided or case.noise == 0:
        return
    kept = case.fit(lambda g: seen + g * lit, np.linspace(0.02, 1, 30))
    left = case.distance(seen + kept * lit)
    shaded = case.valid & (lit.max(axis=0) > 0) & ~case.quantiser.saturated(probe.truth, case.deviation).any(axis=0)
    if kept > MOST_KEPT or left < NOISIER * case.noise or shaded.sum() < 100:
        return
    if probe.alike(np.nan_to_num(case.left(seen + kept * lit)), shaded) < ALIKE:
        told = f"{1 - kept:.0%} of the shadow rays hit the light they end at: no gap is left at its end"
        yield Guess(seen + kept * lit, told, 1, noise=left - case.noise)


def short_shadow_rays(case: Case) -> Iterator[Guess]:
    """Shadow rays that end before the light."""
    yield _under(case, "shadow rays end 1 % short of the light", visibility="short")


def no_shadows(case: Case) -> Iterator[Guess]:
    """No shadow rays."""
    yield _under(case, "nothing casts a shadow", visibility="none")


def missing_pi(case: Case) -> Iterator[Guess]:
    """A diffuse lobe pi times too bright."""
    yield _under(case, "the diffuse albedo is not divided by pi", over_pi=False)


def unclamped_phong(case: Case) -> Iterator[Guess]:
    """A lobe of negative cosines."""
    if case.probe.sight.points.is_glossy:
        yield _under(case, "negative cosines of the Phong lobe are not cut off", lobe="unclamped")


def phong_normalisation(case: Case) -> Iterator[Guess]:
    """Another constant before the lobe."""
    if case.probe.sight.points.is_glossy:
        yield _under(case, "the Phong lobe has (s+1) for (s+2)", lobe="s+1")


def missing_lobe(case: Case) -> Iterator[Guess]:
    """No glossy lobe."""
    if case.probe.sight.points.is_glossy:
        yield _under(case, "the Phong lobe is missing", lobe="none")
