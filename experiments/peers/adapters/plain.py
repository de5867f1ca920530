"""What every adapter does: read the neutral description, say what its parts are, write the image. NumPy alone.

An adapter is run as ``PYTHON run_X.py DESCRIPTION.npz OUTPUT.npz OPTIONS`` with options as JSON; as ``PYTHON run_X.py
serve`` it reads such three words as a line of JSON, again and again.
"""

from __future__ import annotations

import json
import math
import resource
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np

Floats = Any
"""Arrays of float64; ``numpy.typing`` is older in some peers' environments."""


@dataclass(frozen=True)
class Plain:
    """The neutral description; see `nusselt.experiments.peers.description` for the meaning of each array.

    Parameters
    ----------
    size : (2,) int
        Width and height, pixels.
    fov : float
        Vertical, degrees.
    position, look, right, up : (3,)
        Camera; the last three are unit and at right angles.
    corners : (t, 3, 3)
        Triangles, their corners.
    thing : (t,) int
        Which mesh each triangle belongs to.
    albedo, specular : (m, 3)
        Of each mesh: its Lambert and Phong parts.
    shininess : (m,)
    spheres : (s, 4)
        Centre and radius.
    sphere_albedo, sphere_specular, sphere_shininess
    lights : (l, 3, 3)
        Corner and two edges; shines to the side -(ab x ac).
    radiance : (l, 3)
    """

    size: Floats
    fov: float
    position: Floats
    look: Floats
    right: Floats
    up: Floats
    corners: Floats
    thing: Floats
    albedo: Floats
    specular: Floats
    shininess: Floats
    spheres: Floats
    sphere_albedo: Floats
    sphere_specular: Floats
    sphere_shininess: Floats
    lights: Floats
    radiance: Floats

    @property
    def width(self) -> int:
        return int(self.size[0])

    @property
    def height(self) -> int:
        return int(self.size[1])

    @property
    def half_height(self) -> float:
        """Tangent of half the vertical field of view."""
        return math.tan(math.radians(float(self.fov)) / 2)

    @property
    def longer_fov(self) -> float:
        """Field of view of the image's longer side, degrees."""
        return math.degrees(2 * math.atan(self.half_height * max(self.width / self.height, 1.0)))

    def scaled(self, factor: float) -> Plain:
        """The same scene in another unit."""
        names = ("position", "corners", "spheres", "lights")
        return replace(self, **{name: factor * getattr(self, name) for name in names})

    def meshes(self) -> list[tuple[Floats, Floats]]:
        """Each mesh's corners (t, 3, 3) and albedo (3,)."""
        return [(self.corners[self.thing == k], albedo) for k, albedo in enumerate(self.albedo)]

    def balls(self) -> list[tuple[Floats, Floats]]:
        """Each sphere's centre and radius (4,), and albedo (3,)."""
        return list(zip(self.spheres, self.sphere_albedo, strict=True))

    def lamps(self) -> list[tuple[Floats, Floats]]:
        """Each light's corner and edges (3, 3), and radiance (3,)."""
        return list(zip(self.lights, self.radiance, strict=True))

    def centre_rays(self) -> Floats:
        """Unit directions (h * w, 3) through pixel centres, row by row from the top."""
        y, x = np.mgrid[0 : self.height, 0 : self.width] + 0.5
        u = self.half_height * self.width / self.height * (2 * x / self.width - 1)
        v = self.half_height * (1 - 2 * y / self.height)
        d = self.look + u[..., None] * self.right + v[..., None] * self.up
        return (d / np.linalg.norm(d, axis=-1, keepdims=True)).reshape(-1, 3)


def outline(light: Floats) -> Floats:
    """The four corners (4, 3) of a light, counter-clockwise seen from where it shines."""
    corner, ab, ac = light
    return np.array([corner, corner + ac, corner + ab + ac, corner + ab])


def normal_area(light: Floats) -> tuple[Floats, float]:
    """Unit normal of the side that shines, and area."""
    n = -np.cross(light[1], light[2])
    area = float(np.linalg.norm(n))
    return n / area, area


@cache
def ball_mesh(levels: int) -> tuple[Floats, Floats]:
    """Vertices (v, 3) on the unit sphere and faces (f, 3): an icosahedron, its edges halved so many times."""
    g = (1 + 5**0.5) / 2
    v = np.array([p for a in (-1, 1) for b in (-g, g) for p in ((a, b, 0), (0, a, b), (b, 0, a))], dtype=float)
    near = np.linalg.norm(v[:, None] - v, axis=-1) < 2.1
    f = np.array(
        [(i, j, k) for i in range(12) for j in range(i) for k in range(j) if near[i, j] & near[j, k] & near[i, k]]
    )
    turned = np.einsum("ij,ij->i", np.cross(v[f[:, 1]] - v[f[:, 0]], v[f[:, 2]] - v[f[:, 0]]), v[f[:, 0]]) < 0
    f[turned] = f[turned][:, ::-1]
    for _ in range(levels):
        edges = np.sort(np.concatenate([f[:, [0, 1]], f[:, [1, 2]], f[:, [2, 0]]]), axis=1)
        unique, inverse = np.unique(edges, axis=0, return_inverse=True)
        a, b, c = inverse.reshape(3, -1) + len(v)
        v = np.concatenate([v, (v[unique[:, 0]] + v[unique[:, 1]]) / 2])
        f = np.concatenate(
            [np.stack(part, axis=1) for part in ((f[:, 0], a, c), (f[:, 1], b, a), (f[:, 2], c, b), (a, b, c))]
        )
    return v / np.linalg.norm(v, axis=1, keepdims=True), f


def words(values: Floats) -> str:
    """Numbers as text that loses nothing."""
    return " ".join(f"{float(value):.17g}" for value in np.ravel(values))


class Timed:
    """Seconds of all ``with`` blocks under it: by the clock, and of processors, this process's and its children's."""

    def __init__(self) -> None:
        self.spent = np.zeros(2)

    @staticmethod
    def now() -> Floats:
        used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
        return np.array([time.perf_counter(), sum(one.ru_utime + one.ru_stime for one in used)])

    def __enter__(self) -> None:
        self._began = self.now()

    def __exit__(self, *_: object) -> None:
        self.spent += self.now() - self._began


RENDERING = Timed()
"""What adapters take for rendering; all else is start-up."""
SERVE, DONE, FAILED = "serve", "nusselt-peer: done", "nusselt-peer: failed: "
"""The only word of an adapter that does job after job, and what it says of each."""


def run(render: Callable[..., tuple[Floats, str]], scale: float = 1.0) -> None:
    """Read a description, render it so many times as large, write the image (h, w, 3), the version of what made it, and
    what that took.

    Described scenes reach 1 to 2 units from the origin. The scale is chosen so that a renderer's own epsilons are small
    against the scene, and large against its rounding.
    """
    if sys.argv[-1] != SERVE:
        _job(render, scale, sys.argv[-3:])
        return
    for line in sys.stdin:
        RENDERING.spent[:] = 0
        try:
            _job(render, scale, json.loads(line), before=RENDERING.now()[1])
            said = DONE
        except Exception as error:
            said = FAILED + " ".join(f"{type(error).__name__}: {error}".split())
        print(f"\n{said}", flush=True)


def _job(render: Callable[..., tuple[Floats, str]], scale: float, told: list[str], before: float = 0.0) -> None:
    """``before``: processor seconds until it began, of other jobs."""
    source, target, options = told
    with np.load(source) as arrays:
        scene = Plain(**{name: arrays[name] for name in arrays.files})
    image, version = render(scene.scaled(scale), **json.loads(options))
    wall, processor = RENDERING.spent
    spent = np.array([wall, processor, RENDERING.now()[1] - before - processor])
    with open(target, "wb") as file:
        np.savez(file, image=np.asarray(image, dtype=np.float64), version=np.array(version), spent=spent)
