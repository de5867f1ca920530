"""Diffuse albedo that varies over a mesh: texels, looked up where a ray hits.

Albedo is a factor of the reflected radiance, outside every integral: the light that arrives is found as on a surface of
one colour. What varies inside a pixel has no value by area here: scenes with textures are judged at pixel centres.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from .errors import InputError
from .validation import Vec3, triple
from .vectors import Floats, Ints, cross, dot

WRAPS = ("repeat", "mirror", "clamp")
Row2 = tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Texture:
    """A picture of albedo over the uv plane; texel (i, j) is about u = (i + 1/2)/w, v = (j + 1/2)/h.

    Parameters
    ----------
    texels : (3, h, w) float64
        Linear albedo, none negative; the first row is at v = 0.
    smooth : bool
        Bilinear between the middles of texels, else the texel's own colour all over it.
    wrap : {"repeat", "mirror", "clamp"}
        What is outside [0, 1].
    to_uv : two rows of three numbers
        Affine, from a surface's uv to the picture's.
    """

    texels: Floats = field(repr=False)
    smooth: bool = True
    wrap: str = "repeat"
    to_uv: tuple[Row2, Row2] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))

    def __post_init__(self) -> None:
        texels = np.array(self.texels, dtype=np.float64, order="C")
        if texels.ndim != 3 or texels.shape[0] != 3 or texels.size == 0:
            raise InputError("texture shape", texels.shape, "(3, h, w)")
        if not np.isfinite(texels).all() or texels.min() < 0:
            raise InputError("texture", "a texel that is negative or not finite", "an albedo of at least 0")
        if self.wrap not in WRAPS:
            raise InputError("texture wrap", self.wrap, ", ".join(WRAPS))
        if not np.isfinite(self.to_uv).all():
            raise InputError("texture to_uv", self.to_uv, "finite numbers")
        texels.setflags(write=False)
        object.__setattr__(self, "texels", texels)

    @cached_property
    def digest(self) -> str:
        """SHA-256 of everything about it, as hex; found once."""
        told = hashlib.sha256(f"{self.texels.shape},{self.smooth},{self.wrap},{self.to_uv};".encode())
        told.update(self.texels.data)
        return told.hexdigest()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Texture) and self.digest == other.digest

    def __hash__(self) -> int:
        return hash(self.digest)

    def __repr__(self) -> str:
        """With all that it holds: digests of scenes rest on it."""
        return f"Texture({self.digest})"

    @property
    def peak(self) -> Vec3:
        """The largest albedo of each channel."""
        return triple(self.texels.max(axis=(1, 2)))

    def __call__(self, uv: Floats) -> Floats:
        """Albedo (3, n) at a surface's coordinates (2, n)."""
        (a, b, c), (d, e, f) = self.to_uv
        _, height, width = self.texels.shape
        x, y = (a * uv[0] + b * uv[1] + c) * width, (d * uv[0] + e * uv[1] + f) * height
        if not self.smooth:
            return self._at(np.floor(x), np.floor(y))
        left, low = np.floor(x - 0.5), np.floor(y - 0.5)
        s, t = x - 0.5 - left, y - 0.5 - low
        below = (1 - s) * self._at(left, low) + s * self._at(left + 1, low)
        above = (1 - s) * self._at(left, low + 1) + s * self._at(left + 1, low + 1)
        return np.asarray((1 - t) * below + t * above)

    def _at(self, column: Floats, row: Floats) -> Floats:
        """Texels by whole numbers, which may be outside."""
        _, height, width = self.texels.shape
        return np.asarray(self.texels[:, self._inside(row, height), self._inside(column, width)])

    def _inside(self, number: Floats, count: int) -> Ints:
        if self.wrap == "repeat":
            number = np.mod(number, count)
        elif self.wrap == "mirror":
            number = np.mod(number, 2 * count)
            number = np.minimum(number, 2 * count - 1 - number)
        return np.clip(number, 0, count - 1).astype(np.int64)


@dataclass(frozen=True, eq=False)
class Painted:
    """The triangles of a mesh that has a texture.

    Parameters
    ----------
    first : int
        Number of its first triangle among a scene's.
    uv : (2, 3, t) float64
        Of the corners of each.
    texture : Texture
    """

    first: int
    uv: Floats
    texture: Texture

    def albedo(self, corners: tuple[Floats, Floats, Floats], triangle: Ints, place: Floats) -> tuple[Ints, Floats]:
        """Which of n hits are on it (k,), and their albedo (3, k).

        Parameters
        ----------
        corners : three of (3, t)
            Of all triangles of the scene.
        triangle : (n,) int64
            The triangle of each hit, -1 for none.
        place : (3, n) float64
        """
        mine = np.flatnonzero((triangle >= self.first) & (triangle < self.first + self.uv.shape[2]))
        a, b, c = (corner[:, triangle[mine]] for corner in corners)
        p, up = place[:, mine] - a, cross(b - a, c - a)
        square = dot(up, up)
        second, third = dot(cross(p, c - a), up) / square, dot(cross(b - a, p), up) / square
        k = triangle[mine] - self.first
        at = self.uv[:, 0, k] * (1 - second - third) + self.uv[:, 1, k] * second + self.uv[:, 2, k] * third
        return mine, self.texture(at)
