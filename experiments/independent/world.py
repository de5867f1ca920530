"""What a scene is to this renderer, and its reader of the scene text format."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]


@dataclass(frozen=True)
class Light:
    """A light of any kind.

    Parameters
    ----------
    kind : {"quad", "point", "directional", "sun"}
    place : (3,)
        A corner, a position, or the unit direction towards it.
    colour : (3,)
        Radiance, radiant intensity, or irradiance on a plane that faces it.
    u, v : (3,)
        Edges of a quad, which shines to the side -(u x v).
    angle : float
        Angular diameter of a sun, radians.
    """

    kind: str
    place: Floats
    colour: Floats
    u: Floats = field(default_factory=lambda: np.zeros(3))
    v: Floats = field(default_factory=lambda: np.zeros(3))
    angle: float = 0.0

    @property
    def normal(self) -> Floats:
        """Unit, on the side that shines."""
        n = -np.cross(self.u, self.v)
        return np.asarray(n / np.linalg.norm(n))

    @property
    def area(self) -> float:
        return float(np.linalg.norm(np.cross(self.u, self.v)))

    @property
    def sampled(self) -> bool:
        """Whether it has more than one direction from a point."""
        return self.kind in ("quad", "sun")


@dataclass(frozen=True)
class Material:
    """Phong's; each of three channels."""

    diffuse: tuple[float, ...] = (0.0, 0.0, 0.0)
    specular: tuple[float, ...] = (0.0, 0.0, 0.0)
    emission: tuple[float, ...] = (0.0, 0.0, 0.0)
    shininess: float = 1.0


@dataclass(frozen=True)
class World:
    """A scene.

    Parameters
    ----------
    eye, at, up : (3,)
    fov : float
        Vertical, degrees.
    triangles : (t, 3, 3)
        Corners.
    balls : (b, 4, 4)
        From the unit sphere to its place.
    triangle_material, ball_material : (t,), (b,) int
        Into ``materials``.
    lights : tuple of Light
    samples : int
        Per light.
    strata : bool
    """

    width: int = 0
    height: int = 0
    eye: Floats = field(default_factory=lambda: np.zeros(3))
    at: Floats = field(default_factory=lambda: np.zeros(3))
    up: Floats = field(default_factory=lambda: np.zeros(3))
    fov: float = 0.0
    triangles: Floats = field(default_factory=lambda: np.zeros((0, 3, 3)))
    balls: Floats = field(default_factory=lambda: np.zeros((0, 4, 4)))
    triangle_material: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, int))
    ball_material: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, int))
    materials: tuple[Material, ...] = ()
    lights: tuple[Light, ...] = ()
    samples: int = 1
    strata: bool = False

    def sized(self, width: int) -> World:
        """In fewer pixels of the same shape, if it has more."""
        height = max(1, round(self.height * width / self.width))
        return self if self.width <= width else replace(self, width=width, height=height)

    def table(self, name: str) -> Floats:
        """One entry of all materials, (m, 3) or (m,)."""
        return np.array([getattr(material, name) for material in self.materials], dtype=float)


def translation(x: float, y: float, z: float) -> Floats:
    """Its matrix, (4, 4)."""
    m = np.eye(4)
    m[:3, 3] = x, y, z
    return m


def scaling(x: float, y: float, z: float) -> Floats:
    """Its matrix, (4, 4)."""
    return np.diag([x, y, z, 1.0])


def rotation(x: float, y: float, z: float, degrees: float) -> Floats:
    """Rodrigues's formula, I + sin K + (1 - cos) K^2."""
    a = np.array([x, y, z]) / math.sqrt(x * x + y * y + z * z)
    k = np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])
    t = math.radians(degrees)
    m = np.eye(4)
    m[:3, :3] += math.sin(t) * k + (1 - math.cos(t)) * (k @ k)
    return m


MOVES: dict[str, Callable[..., Floats]] = {"translate": translation, "scale": scaling, "rotate": rotation}
QUIET = {"output", "integrator", "maxdepth", "maxverts", "maxvertnorms", "spp", "attenuation", "ambient"}


class _Reader:
    """Reads line by line: materials and transforms are those that hold where a surface is named."""

    def __init__(self) -> None:
        self.head: dict[str, Any] = {}
        self.material = Material()
        self.materials: list[Material] = []
        self.stack = [np.eye(4)]
        self.vertices: list[list[float]] = []
        self.triangles: list[tuple[Floats, int]] = []
        self.balls: list[tuple[Floats, int]] = []
        self.lights: list[Light] = []

    def line(self, word: str, rest: list[str]) -> None:
        if word in QUIET:
            return
        if word == "pushTransform":
            self.stack.append(self.stack[-1])
        elif word == "popTransform":
            self.stack.pop()
        elif word == "lightstratify":
            self.head["strata"] = rest[0] == "on"
        else:
            self.numbers(word, [float(number) for number in rest])

    def numbers(self, word: str, n: list[float]) -> None:
        a = np.array(n)
        if word == "size":
            self.head |= {"width": int(n[0]), "height": int(n[1])}
        elif word == "camera":
            self.head |= {"eye": a[:3], "at": a[3:6], "up": a[6:9], "fov": n[9]}
        elif word == "lightsamples":
            self.head["samples"] = int(n[0])
        elif word in MOVES:
            self.stack[-1] = self.stack[-1] @ MOVES[word](*n)
        elif word in ("diffuse", "specular", "emission"):
            changed: dict[str, Any] = {word: tuple(n)}
            self.material = replace(self.material, **changed)
        elif word == "shininess":
            self.material = replace(self.material, shininess=n[0])
        elif word == "vertex":
            self.vertices.append(n)
        elif word == "tri":
            corners = np.array([self.vertices[int(k)] for k in n]) @ self.stack[-1][:3, :3].T
            self.triangles.append((corners + self.stack[-1][:3, 3], self.number()))
        elif word == "sphere":
            self.balls.append((self.stack[-1] @ translation(*n[:3]) @ scaling(n[3], n[3], n[3]), self.number()))
        else:
            self.lights.append(light_of(word, a))

    def number(self) -> int:
        """Of the material that holds now."""
        if not self.materials or self.materials[-1] != self.material:
            self.materials.append(self.material)
        return len(self.materials) - 1

    def world(self) -> World:
        return World(
            **self.head,
            triangles=np.array([corners for corners, _ in self.triangles]).reshape(-1, 3, 3),
            balls=np.array([matrix for matrix, _ in self.balls]).reshape(-1, 4, 4),
            triangle_material=np.array([number for _, number in self.triangles], dtype=int),
            ball_material=np.array([number for _, number in self.balls], dtype=int),
            materials=tuple(self.materials) or (Material(),),
            lights=tuple(self.lights),
        )


def light_of(word: str, a: Floats) -> Light:
    """A light from its line of the text.

    Raises
    ------
    ValueError
        If the word is none that this renderer knows.
    """
    if word == "quadLight":
        return Light("quad", a[:3], a[9:12], a[3:6], a[6:9])
    if word == "point":
        return Light("point", a[:3], a[3:6])
    if word in ("directional", "sun"):
        angle = math.radians(a[6]) if word == "sun" else 0.0
        return Light(word, a[:3] / np.linalg.norm(a[:3]), a[3:6], angle=angle)
    known = "quadLight, point, directional or sun"
    raise ValueError(f"{word} = {a.tolist()}: expected a light that this renderer knows: {known}")


def read_world(text: str) -> World:
    """A scene of the text format.

    Raises
    ------
    ValueError
        If a word is none of those that this renderer knows.
    """
    reader = _Reader()
    for line in text.splitlines():
        word, *rest = line.split() or ["#"]
        if not word.startswith("#"):
            reader.line(word, rest)
    return reader.world()
