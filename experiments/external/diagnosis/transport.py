"""Mistakes in how light is reckoned: cosines, falloff, areas, lobes. Each is one rule in place of the right one."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from nusselt.renderer.vectors import Floats, dot

from .beams import RIGHT, Beams, Rule, diffuse, power, right_lobe, specular
from .case import Case, Guess
from .probe import Paths

ALONE = 4
"""Lights of which each is tried alone, at most."""

Applies = Callable[[Beams], bool]


def anywhere(b: Beams) -> bool:
    """Of any light."""
    return True


def flat(b: Beams) -> bool:
    """Of lights whose area shines from a plane."""
    return b.light.plane() is not None and b.light.area > 0


def near(b: Beams) -> bool:
    """Of lights that are somewhere."""
    return not b.light.at_infinity


def glossy(b: Beams) -> bool:
    """Where a Phong lobe is seen."""
    return b.points.is_glossy and bool((b.points.specular > 0).any())


@dataclass(frozen=True)
class Variant:
    """A rule with a mistake: its name, what is wrong, lights that it can be wrong for.

    ``all_round`` if light comes from where there is none: everything may block it.
    """

    name: str
    detail: str
    rule: Rule
    applies: Applies = anywhere
    all_round: bool = False


def _weight(
    name: str, detail: str, weight: Callable[[Beams], Floats], applies: Applies = anywhere, all_round: bool = False
) -> Variant:
    return Variant(name, detail, replace(RIGHT, weight=weight), applies, all_round)


def _front(b: Beams) -> Floats:
    return np.maximum(b.cosine, 0)


def _falloff(power_: int) -> Callable[[Beams], Floats]:
    """Divided by another power of the distance."""
    return lambda b: b.worth * b.r ** (2 - power_) * _front(b)


def _at_light(change: Callable[[Floats], Floats]) -> Callable[[Beams], Floats]:
    """Another function of the cosine at the light."""
    return lambda b: b.light.area / b.r**2 * change(b.at_light) * _front(b)


WEIGHTS = (
    _weight("missing-cosine", "the cosine at the surface is missing", lambda b: b.worth * (b.cosine > 0)),
    _weight("cosine-squared", "the cosine at the surface is there twice", lambda b: b.worth * _front(b) ** 2),
    _weight(
        "cosine-not-clamped",
        "negative cosines at the surface are not cut off",
        lambda b: b.worth * b.cosine,
        all_round=True,
    ),
    _weight(
        "cosine-not-clamped",
        "the cosine's absolute value is taken",
        lambda b: b.worth * np.abs(b.cosine),
        all_round=True,
    ),
    _weight("eye-cosine", "times the cosine towards the eye", lambda b: b.worth * _front(b) * b.eye),
    _weight("eye-cosine", "the cosine towards the eye in place of that to the light", lambda b: b.worth * b.eye),
    _weight("eye-cosine", "over the cosine towards the eye", lambda b: b.worth * _front(b) / np.maximum(b.eye, 1e-3)),
    _weight(
        "missing-light-cosine",
        "the cosine at the light is missing",
        _at_light(lambda c: np.where(c > 0, 1.0, 0.0)),
        flat,
    ),
    _weight(
        "light-cosine-squared",
        "the cosine at the light is there twice",
        _at_light(lambda c: np.maximum(c, 0) ** 2),
        flat,
    ),
    _weight("two-sided-light", "lights emit on both sides", _at_light(np.abs), flat, True),
    _weight("light-flipped", "lights emit on their back", _at_light(lambda c: np.maximum(-c, 0)), flat, True),
    _weight("wrong-falloff", "divided by the distance, not by its square", _falloff(1), near),
    _weight("wrong-falloff", "not divided by the distance", _falloff(0), near),
    _weight("wrong-falloff", "divided by the third power of the distance", _falloff(3), near),
    _weight("wrong-falloff", "divided by the fourth power of the distance", _falloff(4), near),
    _weight(
        "missing-jacobian",
        "an area is not made a solid angle: no cosine at the light, no distance squared",
        lambda b: b.light.area * (b.at_light > 0) * _front(b),
        flat,
    ),
    _weight(
        "jacobian-twice",
        "an area is made a solid angle twice",
        lambda b: b.worth**2 / b.light.area * _front(b),
        flat,
    ),
    _weight(
        "jacobian-twice",
        "an area is made a solid angle twice, the light's area with it",
        lambda b: b.worth**2 * _front(b),
        flat,
    ),
)


def _lobe(name: str, detail: str, lobe: Callable[[Beams], Floats] | None) -> Variant:
    return Variant(name, detail, replace(RIGHT, lobe=lobe), glossy)


def _norm(s: Floats, name: str) -> Floats:
    return {
        "s+1": (s + 1) / (2 * math.pi),
        "s+8": (s + 8) / (8 * math.pi),
        "none": np.ones_like(s),
        "pi": 1 / math.pi + 0 * s,
        "2pi": 1 / (2 * math.pi) + 0 * s,
    }[name]


def _normed(name: str) -> Callable[[Beams], Floats]:
    return lambda b: _norm(b.exponent, name) * power(b.mirror, b.exponent)


def _exponent(change: Callable[[Floats], Floats]) -> Callable[[Beams], Floats]:
    def lobe(b: Beams) -> Floats:
        s = change(b.exponent)
        return np.asarray((s + 2) / (2 * math.pi) * power(b.mirror, s))

    return lobe


def _half(times: float) -> Callable[[Beams], Floats]:
    return lambda b: (b.exponent + 2) / (2 * math.pi) * power(b.half, times * b.exponent)


def _unclamped(b: Beams) -> Floats:
    with np.errstate(invalid="ignore", under="ignore"):
        return np.asarray((b.exponent + 2) / (2 * math.pi) * np.nan_to_num(b.mirror**b.exponent))


def _without_cosine(b: Beams) -> Floats:
    return right_lobe(b) / np.maximum(b.cosine, 1e-3)


def _ks(b: Beams) -> Floats:
    return b.points.specular.max(axis=0)[:, None]


def _schlick(b: Beams) -> Floats:
    """k_s + (1 - k_s) (1 - h.w)^5."""
    between = dot(b.d / b.r, b.points.outgoing[:, :, None])
    of_half = np.sqrt(np.maximum((1 + between) / 2, 0))  # the half vector's cosine to either
    return np.asarray(_ks(b) + (1 - _ks(b)) * (1 - of_half) ** 5)


def _grazing(cosine: Floats) -> Floats:
    return np.asarray(0.04 + 0.96 * (1 - np.clip(cosine, 0, 1)) ** 5)


def _opposite(b: Beams) -> Floats:
    away = 2 * dot(b.points.normal, b.points.outgoing) * b.points.normal - b.points.outgoing
    return (b.exponent + 2) / (2 * math.pi) * power(-dot(away[:, :, None], b.d) / b.r, b.exponent)


LOBES = (
    _lobe("missing-lobe", "the Phong lobe is missing", None),
    _lobe("phong-normalisation", "the Phong lobe has (s+1) for (s+2)", _normed("s+1")),
    _lobe("phong-normalisation", "the lobe has (s+8) / 8 pi, Blinn's norm, for (s+2) / 2 pi", _normed("s+8")),
    _lobe("phong-normalisation", "the Phong lobe has no norm: (s+2) / 2 pi is missing", _normed("none")),
    _lobe("phong-normalisation", "the Phong lobe has 1 / pi for (s+2) / 2 pi", _normed("pi")),
    _lobe("phong-normalisation", "the Phong lobe has 1 / 2 pi for (s+2) / 2 pi", _normed("2pi")),
    _lobe("phong-normalisation", "the Phong lobe is over pi once more", lambda b: right_lobe(b) / math.pi),
    _lobe("wrong-exponent", "the exponent is one more", _exponent(lambda s: s + 1)),
    _lobe("wrong-exponent", "the exponent is one less", _exponent(lambda s: np.maximum(s - 1, 0))),
    _lobe("wrong-exponent", "the exponent is twice what is right", _exponent(lambda s: 2 * s)),
    _lobe("wrong-exponent", "the exponent is half of what is right", _exponent(lambda s: s / 2)),
    _lobe("wrong-exponent", "the exponent is four times what is right", _exponent(lambda s: 4 * s)),
    _lobe("wrong-exponent", "the exponent is a quarter of what is right", _exponent(lambda s: s / 4)),
    _lobe("half-vector", "the half vector in place of the mirror direction (Blinn)", _half(1)),
    _lobe("half-vector", "the half vector with four times the exponent (Blinn)", _half(4)),
    _lobe("mirror-direction", "the lobe is about the opposite of the mirror direction", _opposite),
    _lobe(
        "mirror-direction",
        "the lobe is about the direction to the eye",
        lambda b: (b.exponent + 2) / (2 * math.pi) * power(dot(b.points.outgoing[:, :, None], b.d) / b.r, b.exponent),
    ),
    _lobe("unclamped-phong", "negative cosines of the Phong lobe are not cut off", _unclamped),
    _lobe("lobe-without-cosine", "the Phong lobe is not times the cosine at the surface", _without_cosine),
    _lobe(
        "clamped-highlights", "the Phong lobe is cut off at 1 per steradian", lambda b: np.minimum(right_lobe(b), 1.0)
    ),
    _lobe(
        "fresnel", "Schlick's factor in place of k_s", lambda b: right_lobe(b) * _schlick(b) / np.maximum(_ks(b), 1e-9)
    ),
    _lobe("fresnel", "Schlick's factor from 0.04 on the Phong lobe", lambda b: right_lobe(b) * _grazing(b.half)),
    _lobe(
        "fresnel", "Schlick's factor from 0.04, by the surface's cosine", lambda b: right_lobe(b) * _grazing(b.cosine)
    ),
    _lobe("fresnel", "Schlick's factor on the Phong lobe", lambda b: right_lobe(b) * _schlick(b)),
)


def _shine(b: Beams) -> Floats:
    """(1, n): 1 where a surface has a Phong lobe."""
    return (b.points.specular.max(axis=0, keepdims=True) > 0).astype(float)


def _albedo(name: str, detail: str, change: Callable[[Beams], Floats], applies: Applies = anywhere) -> Variant:
    return Variant(name, detail, replace(RIGHT, diffuse=change), applies)


def _of_lobe(name: str, detail: str, change: Callable[[Beams], Floats]) -> Variant:
    return Variant(name, detail, replace(RIGHT, specular=change), glossy)


ALBEDOS = (
    _albedo("albedo-twice", "the diffuse albedo is there twice", lambda b: diffuse(b) * b.points.diffuse),
    _albedo("albedo-missing", "the diffuse albedo is missing", lambda b: 0 * diffuse(b) + 1 / math.pi),
    _albedo(
        "albedo-decoded", "the diffuse albedo is decoded from gamma 2.2", lambda b: b.points.diffuse**2.2 / math.pi
    ),
    _albedo(
        "albedo-encoded",
        "the diffuse albedo is encoded with gamma 2.2",
        lambda b: b.points.diffuse ** (1 / 2.2) / math.pi,
    ),
    _albedo("diffuse-missing", "glossy things have no diffuse part", lambda b: diffuse(b) * (1 - _shine(b)), glossy),
    _albedo(
        "energy-shared", "the diffuse albedo is times 1 - k_s", lambda b: diffuse(b) * (1 - b.points.specular), glossy
    ),
    _of_lobe("lobe-colour", "the Phong lobe has the diffuse albedo too", lambda b: specular(b) * b.points.diffuse),
    _of_lobe(
        "lobe-colour",
        "the Phong lobe has the diffuse albedo in place of its own",
        lambda b: b.points.diffuse * _shine(b),
    ),
    _of_lobe("lobe-colour", "the Phong lobe's albedo is there twice", lambda b: specular(b) ** 2),
)

VARIANTS = (*WEIGHTS, *LOBES, *ALBEDOS)


def changed(case: Case, name: str, detail: str, parts: Sequence[tuple[Paths, Floats]], fitted: int = 0) -> Guess:
    """The truth with some lights' light (3, n, passes) in place of the right.

    Where it is that of all lights, the right light, known without noise, takes off as much noise as it can: it is a
    control variate, and the other light of a dark image has a part of its noise alone.
    """
    prediction, lit = case.truth.copy(), case.probe.sight.lit
    nothing = np.zeros((1, 1, 1))
    other, right = sum((new for _, new in parts), nothing), sum((path.right for path, _ in parts), nothing)
    share = 1.0
    noise = float((case.probe.swing**2).sum()) if len(parts) == len(case.probe.paths) else 0.0
    if noise > 0:
        share = max(float((other * case.probe.swing).sum()) / noise, 0.0)
    step = other - share * right
    prediction[:, lit] += step.mean(axis=2) - (1 - share) * (case.truth - case.probe.sight.emission)[:, lit]
    error = np.zeros(case.truth.shape[1])
    if step.shape[2] > 1:
        error[lit] = (step.var(axis=2, ddof=1) / step.shape[2]).mean(axis=0)
    return Guess(name, prediction, detail, fitted, error)


def groups(paths: Sequence[Paths], lights: int) -> Iterator[tuple[str, list[Paths]]]:
    """All lights together, then each alone, with the words for it."""
    if paths:
        some = "" if len(paths) == lights else " (" + ", ".join(said(path) for path in paths) + ")"
        yield some, list(paths)
    if lights > 1 and 1 < len(paths) <= ALONE:
        for path in paths:
            yield f" (of {said(path)} alone)", [path]


def said(path: Paths) -> str:
    """A light by its number, and its line in the scene's file."""
    line = f" (line {path.line})" if path.line else ""
    return f"light {path.source.index + 1}, {path.light.kind}{line}"


def rules(case: Case) -> Iterator[Guess]:
    """Every variant, of all lights that it can be of and of each."""
    probe = case.probe
    for variant in VARIANTS:
        paths = [path for path in probe.paths if variant.applies(path.beams)]
        for words, chosen in groups(paths, len(probe.paths)):
            parts = [(p, variant.rule.radiance(p.all_round if variant.all_round else p.beams)) for p in chosen]
            guess = changed(case, variant.name, variant.detail + words, parts)
            yield guess
            if variant.name in ("light-flipped", "two-sided-light"):
                yield _as_seen(case, guess)
    glow = np.where(probe.sight.light >= 0, probe.sight.glow, case.truth)
    if (glow != case.truth).any():
        yield Guess("two-sided-light", glow, "lights are seen from their back too, and light to their front alone")


CAPS = (0.5, 1.0, 2.0, 5.0, 10.0)
"""Radiance at which samples may be cut off."""


def samples_cut_off(case: Case) -> Iterator[Guess]:
    """Each sample of each light cut off at some radiance."""
    probe = case.probe
    for cap in CAPS:
        parts = [(path, _capped(path.beams, cap)) for path in probe.paths if path.light.has_extent]
        if any((made != path.right).any() for path, made in parts):
            yield changed(case, "clamped-highlights", f"samples above {cap:g} are cut off", parts)


def _capped(b: Beams, cap: float) -> Floats:
    return np.stack([b.mean(np.minimum(value, cap)) for value in RIGHT.samples(b)])


def _as_seen(case: Case, guess: Guess) -> Guess:
    """The same, and lights are seen so."""
    sight = case.probe.sight
    seen = sight.glow - sight.emission if guess.name == "light-flipped" else sight.glow
    shown = np.where(sight.light >= 0, seen, 0.0) + np.where(sight.light >= 0, 0.0, guess.prediction)
    return replace(guess, prediction=shown, detail=guess.detail + ", and are seen so")
