"""Numbers, vectors and colours of a scene, validated on the way in: each gives itself or one clear error."""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from .errors import InputError

Vec3: TypeAlias = tuple[float, float, float]


def triple(values: ArrayLike) -> Vec3:
    """Three numbers of an array, plain."""
    x, y, z = np.asarray(values, dtype=np.float64).tolist()
    return x, y, z


def finite(name: str, value: object) -> float:
    """A finite number, or an InputError of that name."""
    try:
        number = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        raise InputError(name, value, "a finite number") from None
    if not math.isfinite(number):
        raise InputError(name, value, "a finite number")
    return number + 0.0  # -0.0 becomes 0.0: equal scenes have equal digests


def vector(name: str, value: object) -> Vec3:
    """Three finite numbers, or an InputError of that name."""
    try:
        components: tuple[object, ...] = tuple(value)  # type: ignore[arg-type]
    except TypeError:
        components = ()
    if len(components) != 3:
        raise InputError(name, value, "three finite numbers")
    return finite(name, components[0]), finite(name, components[1]), finite(name, components[2])


def colour(name: str, value: object) -> Vec3:
    """Three numbers, none negative, or an InputError of that name."""
    rgb = vector(name, value)
    if min(rgb) < 0:
        raise InputError(name, value, "three numbers, none negative")
    return rgb


def cross(a: Vec3, b: Vec3) -> Vec3:
    """Cross product of two vectors."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def unit(name: str, v: Vec3) -> Vec3:
    """A vector of length one along v; an InputError of that name where v is zero."""
    scale = max(map(abs, v))  # first: squares of 1e-200 vanish
    if scale == 0:
        raise InputError(name, v, "a vector that is not zero")
    x, y, z = (c / scale for c in v)
    length = math.sqrt(x * x + y * y + z * z)
    return x / length, y / length, z / length


def direction(name: str, value: object) -> Vec3:
    """A unit vector; one that is so already to rounding is kept, so that a copy of a light equals it."""
    v = vector(name, value)
    if abs(v[0] * v[0] + v[1] * v[1] + v[2] * v[2] - 1) < 2e-15:
        return v
    return vector(name, unit(name, v))


def parallel(a: Vec3, b: Vec3) -> bool:
    """Whether two vectors span no area to rounding; scale-free."""
    ua, ub = unit("", a), unit("", b)
    return max(map(abs, cross(ua, ub))) < 4e-16
