"""Pixels mixed with their neighbours."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from scipy import ndimage

from nusselt.renderer.vectors import Floats

from .camera import edges_moved
from .case import Case, Guess
from .probe import Sight


def _mean(size: int) -> Callable[[Floats], Floats]:
    return lambda image: ndimage.uniform_filter(image, (1, size, size), mode="nearest")


def _gauss(sigma: float) -> Callable[[Floats], Floats]:
    return lambda image: ndimage.gaussian_filter(image, (0, sigma, sigma), mode="nearest")


FILTERS: dict[str, Callable[[Floats], Floats]] = {
    "the mean of 3 x 3 pixels": _mean(3),
    "the mean of 5 x 5 pixels": _mean(5),
    "the mean of 2 x 2 pixels": _mean(2),
    "the median of 3 x 3 pixels": lambda image: ndimage.median_filter(image, (1, 3, 3), mode="nearest"),
    "the median of 5 x 5 pixels": lambda image: ndimage.median_filter(image, (1, 5, 5), mode="nearest"),
    "a Gaussian of half a pixel": _gauss(0.5),
    "a Gaussian of a pixel": _gauss(1.0),
    "a Gaussian of two pixels": _gauss(2.0),
    "sharpened: twice the image less its mean of 3 x 3": lambda image: 2 * image - _mean(3)(image),
}


def filters(case: Case) -> Iterator[Guess]:
    """Pixels mixed with their neighbours."""
    for told, change in FILTERS.items():
        image = case.probe.pick(change(case.given.mean))
        yield Guess("filter", image, f"pixels are filtered: {told}")
        lit = np.where(case.lit, image, case.truth)
        yield Guess("filter", lit, f"pixels of surfaces are filtered: {told}")
    mean = case.probe.pick(_mean(3)(case.given.mean))
    (share,) = case.combined((mean - case.truth)[None], case.truth)
    told = f"pixels are filtered: {share:.3g} of the way to the mean of 3 x 3 pixels"
    yield Guess("filter", case.truth + share * (mean - case.truth), told, 1)


OVER = 5
"""Points of a pixel along each side: an odd number, its centre among them."""
REACH = 2
"""Pixels to either side within which filters mix, and beyond edges that are looked at closely."""
ALIKE = 0.5
"""Difference of normals' parts up to which two points are of one face."""
SIGMAS = np.array([0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0])


def _blackman_harris(x: Floats) -> Floats:
    """Of -1 to 1 (Harris 1978)."""
    t = np.pi * (x + 1)
    return np.asarray(0.35875 - 0.48829 * np.cos(t) + 0.14128 * np.cos(2 * t) - 0.01168 * np.cos(3 * t))


KERNELS: dict[str, tuple[float, Callable[[Floats], Floats]]] = {
    "a Blackman-Harris filter, 3 pixels across: the width 1.5 of path tracers": (1.5, _blackman_harris),
    "a Blackman-Harris filter, 4 pixels across: the width 2 of path tracers": (2.0, _blackman_harris),
    "a tent, 2 pixels across": (1.0, lambda x: 1 - np.abs(x)),
    "a tent, 4 pixels across": (2.0, lambda x: 1 - np.abs(x)),
    "a square, 2 pixels across": (1.0, np.ones_like),
    "a square, 3 pixels across": (1.5, np.ones_like),
}
"""Filters that rays are drawn by: how far they reach to either side in pixels, and their weight from -1 to 1 of it."""


def drawn(case: Case) -> Iterator[Guess]:
    """Rays drawn by a reconstruction filter, where they should pass centres, or anywhere in a pixel alone."""
    if case.probe.stride > 1 or not edges_moved(case):
        return
    fine = _fine(case)
    area = case.probe.scene.spp > 1
    right = _through(fine, _kernel(0.5, np.ones_like)) if area else fine[:, OVER // 2 :: OVER, OVER // 2 :: OVER]

    def seen(kernel: Floats) -> Floats:
        return np.asarray(case.truth + (_through(fine, kernel) - right).reshape(3, -1))

    def guess(told: str, kernel: Floats, fitted: int = 0) -> Guess:
        mean = _through(fine, kernel)
        spread = np.maximum(_through(fine**2, kernel) - mean**2, 0).mean(axis=0).ravel()
        told = f"rays are drawn by {told}"
        return Guess("filter", seen(kernel), told, fitted, spread / OVER**2, noise=spread / case.probe.samples)

    for told, (reach, weight) in KERNELS.items():
        yield guess(told, _kernel(reach, weight))
    sigma = case.nearest(lambda value: seen(_gaussian(value)), SIGMAS)
    yield guess(f"a Gaussian of {sigma:.3g} pixels", _gaussian(sigma), 1)


def _kernel(reach: float, weight: Callable[[Floats], Floats]) -> Floats:
    """Weights at the fine points, at their cells' mean."""
    x = (np.arange(-REACH * OVER * 10, REACH * OVER * 10) + 0.5) / (10 * OVER)
    inside = np.where(np.abs(x) < reach, np.maximum(weight(x / reach), 0), 0.0)
    inside = np.pad(inside, 5).reshape(-1, 10).sum(axis=1)
    return np.asarray(inside / inside.sum())


def _gaussian(sigma: float) -> Floats:
    return _kernel(REACH, lambda x: np.exp(-0.5 * (x * REACH / sigma) ** 2))


def _through(fine: Floats, kernel: Floats) -> Floats:
    """Pixels (3, h, w) that are the fine image's mean by a kernel along both sides."""
    rows = ndimage.correlate1d(fine, kernel, 1, mode="nearest")[:, OVER // 2 :: OVER]
    return np.asarray(ndimage.correlate1d(rows, kernel, 2, mode="nearest")[:, :, OVER // 2 :: OVER])


def _fine(case: Case) -> Floats:
    """The right image (3, h OVER, w OVER) at the pixels' fine points.

    Where edges are near, what is lit takes the light of pixels about that show the same thing, turned the same way;
    lights are as they are.
    """
    probe = case.probe
    mean, shown = probe.grid(case.truth), probe.grid(_shown(probe.sight))
    at = np.stack(np.meshgrid(*((np.arange(n * OVER) - OVER // 2) / OVER for n in mean.shape[1:]), indexing="ij"))
    fine = np.stack([ndimage.map_coordinates(channel, at, order=1, mode="nearest") for channel in mean])
    apart = (ndimage.maximum_filter(shown, (1, 3, 3)) - ndimage.minimum_filter(shown, (1, 3, 3))).max(axis=0) > ALIKE
    near = ndimage.binary_dilation(apart, np.ones((3, 3)), iterations=REACH)
    close = near.repeat(OVER, axis=0).repeat(OVER, axis=1)
    y, x = at[:, close]
    sight = probe.look(x + 0.5, y + 0.5)
    here, mixed = _shown(sight), apart & (probe.scene.spp > 1)
    total, weights = np.zeros((3, x.size)), np.zeros(x.size)
    for step in np.ndindex(5, 5):
        row, column = (
            np.clip(np.rint(v).astype(int) + s - 2, 0, n - 1) for v, s, n in zip((y, x), step, apart.shape, strict=True)
        )
        squares = (row - y) ** 2 + (column - x) ** 2 + np.where(mixed[row, column], 1.0, 1e-3)
        weight = (np.abs(shown[:, row, column] - here).max(axis=0) <= ALIKE) / squares**2
        total += weight * mean[:, row, column]
        weights += weight
    fine[:, close] = np.where(weights > 0, total / np.maximum(weights, 1e-300), fine[:, close])
    plain = np.ones(x.size, dtype=bool)
    plain[sight.lit] = False
    fine[:, close] = np.where(plain, sight.emission, fine[:, close])
    return fine


def _shown(sight: Sight) -> Floats:
    """What is seen, and which way it is turned: (4, n), apart by more than `ALIKE` where an edge is between."""
    out = np.zeros((4, sight.surface.size))
    out[0] = sight.surface
    out[1:, sight.lit] = sight.points.normal
    return out
