"""Parts of one image, made at different times, put together as if they had been one run."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from nusselt.mitsuba_bridge.reference import Reference
from nusselt.renderer.image import Image
from nusselt.renderer.vectors import Floats


def _moments(counts: Sequence[int], means: Sequence[Floats], variances: Sequence[Floats]) -> tuple[Floats, Floats]:
    """Mean and unbiased variance of all passes from those of the parts (Chan, Golub & LeVeque 1983)."""
    total = sum(counts)
    mean = np.sum([n * m for n, m in zip(counts, means, strict=True)], axis=0) / total
    square = sum((n - 1) * v + n * (m - mean) ** 2 for n, m, v in zip(counts, means, variances, strict=True))
    return mean, np.asarray(square / max(total - 1, 1))


def combine_images(parts: Sequence[Image]) -> Image:
    """All passes of some renders of one scene with different seeds."""
    if len(parts) == 1:
        return parts[0]
    first, counts = parts[0], [part.pass_means.size for part in parts]

    def joined(mean: str, variance: str) -> tuple[Floats, Floats]:
        return _moments(counts, [getattr(p, mean) for p in parts], [getattr(p, variance) for p in parts])

    def share(name: str) -> Floats:
        return np.asarray(
            np.sum([n * getattr(p, name) for n, p in zip(counts, parts, strict=True)], axis=0) / sum(counts)
        )

    mean, variance = joined("mean", "variance")
    level_mean, level_variance = first.level_mean, first.level_variance
    if level_mean is not None:
        level_mean, level_variance = joined("level_mean", "level_variance")
    averages = [part.mean.mean(axis=0) for part in parts]
    _, pixel_variance = _moments(counts, averages, [part.pixel_variance for part in parts])
    return dataclasses.replace(
        first,
        mean=mean,
        variance=variance,
        pixel_variance=pixel_variance,
        level_mean=level_mean,
        level_variance=level_variance,
        emitter=share("emitter"),
        background=share("background"),
        unjudged=np.logical_or.reduce([part.unjudged for part in parts]),
        pass_means=np.concatenate([part.pass_means for part in parts]),
        light_means=None if first.light_means is None else share("light_means"),
    )


def combine_references(parts: Sequence[Reference]) -> Reference:
    """Independent references of one scene, weighted by their samples.

    Pass j of the whole is the weighted mean of pass j of every part: as many passes as in one part, each as
    precise as all parts allow.
    """
    if len(parts) == 1:
        return parts[0]
    weights = np.array([part.samples for part in parts]) / sum(part.samples for part in parts)

    def mean(name: str) -> Floats:
        return np.asarray(sum(w * getattr(p, name) for w, p in zip(weights, parts, strict=True)))

    def error(name: str) -> Floats:
        return np.sqrt(np.asarray(sum((w * getattr(p, name)) ** 2 for w, p in zip(weights, parts, strict=True))))

    first = parts[0]
    same = all(
        np.array_equal(p.emitter, first.emitter) and np.array_equal(p.background, first.background) for p in parts
    )
    return dataclasses.replace(
        first,
        mean=mean("mean"),
        standard_error=error("standard_error"),
        pixel_standard_error=error("pixel_standard_error"),
        emitter=first.emitter if same else mean("emitter"),
        background=first.background if same else mean("background"),
        holes=np.maximum.reduce([part.holes for part in parts]),
        pass_means=mean("pass_means"),
        samples=sum(part.samples for part in parts),
        light_samples=tuple(sum(counts) for counts in zip(*(part.light_samples for part in parts), strict=True)),
        passes=sum(part.passes for part in parts),
    )
