"""What random scenes are put together from; whole coordinates, so that planes, edges and corners are shared."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from nusselt.experiments.scenes.shapes import box
from nusselt.renderer.lights import Light, QuadLight
from nusselt.renderer.surfaces import Ellipsoid, Material, Mesh
from nusselt.renderer.vectors import Floats

from .motions import rows

EXPONENTS = (0.0, 0.5, 1.0, 2.0, 7.3, 20.0, 100.0, 1000.0, 1e5)
AXES = np.eye(3)


@dataclass
class Maker:
    """Chance, and what it has made so far."""

    rng: np.random.Generator
    shiny: float = 0.3
    meshes: list[Mesh] = field(default_factory=list)
    ellipsoids: list[Ellipsoid] = field(default_factory=list)
    lights: list[Light] = field(default_factory=list)
    boxes: list[tuple[Floats, Floats]] = field(default_factory=list)

    def chance(self, share: float) -> bool:
        return bool(self.rng.random() < share)

    def whole(self, low: int, high: int) -> float:
        """low to high, both included."""
        return float(self.rng.integers(low, high + 1))

    def wholes(self, low: Any, high: Any) -> Floats:
        return self.rng.integers(np.array(low), np.array(high) + 1).astype(float)

    def pick(self, options: Any) -> Any:
        return options[int(self.rng.integers(len(options)))]

    def small(self, low: float, high: float) -> float:
        """10 to a power between, or a multiple of it."""
        power = self.rng.uniform(low, high)
        return float(10.0 ** np.floor(power)) if self.chance(0.5) else float(10.0**power)

    def material(self) -> Material:
        shades = (0.125, 0.25, 0.375, 0.5)
        diffuse = tuple(float(self.pick(shades)) for _ in range(3))
        if not self.chance(self.shiny):
            return Material(diffuse)  # type: ignore[arg-type]
        specular = tuple(float(self.pick(shades)) for _ in range(3))
        if self.chance(0.2):
            diffuse = (0.0, 0.0, 0.0)
        return Material(diffuse, specular, self.pick(EXPONENTS))  # type: ignore[arg-type]

    def rectangle(self, corner: Any, u: Any, v: Any, material: Material | None = None) -> None:
        """Two triangles that face u x v."""
        p, a, b = (np.asarray(w, dtype=float) for w in (corner, u, v))
        vertices = np.stack((p, p + a, p + a + b, p + b), axis=1)
        self.meshes.append(Mesh(vertices, np.array([[0, 1, 2], [0, 2, 3]]).T, material or self.material()))

    def level(self, x: Any, z: Any, y: float) -> None:
        """A level rectangle that faces up."""
        self.rectangle((x[0], y, z[0]), (0, 0, z[1] - z[0]), (x[1] - x[0], 0, 0))

    def floor(self) -> None:
        half = self.pick((4.0, 6.0, 8.0))
        self.level((-half, half), (-half, half), 0.0)

    def wall(self) -> None:
        """Beside the middle, facing it."""
        away = self.pick((2.0, 3.0, 4.0))
        if self.chance(0.5):
            self.rectangle((-away, 0, -4), (0, 4, 0), (0, 0, 8))
        else:
            self.rectangle((-4, 0, -away), (8, 0, 0), (0, 4, 0))

    def box(self, low: Any, high: Any) -> None:
        """In one of the ways in which a box is given."""
        low, high = np.asarray(low, dtype=float), np.asarray(high, dtype=float)
        self.boxes.append((low, high))
        whole = box(tuple(low), tuple(high), self.material(), self.chance(0.05))
        way = self.rng.random()
        if way < 0.6:
            self.meshes.append(whole)
        elif way < 0.75:  # open
            faces = np.sort(self.rng.permutation(6)[: int(self.rng.integers(3, 6))])
            kept = (2 * faces[:, None] + np.arange(2)).ravel()
            self.meshes.append(Mesh(whole.vertices, whole.triangles[:, kept], whole.material))
        elif way < 0.88:  # each face for itself
            for face in range(6):
                self.meshes.append(Mesh(whole.vertices, whole.triangles[:, 2 * face : 2 * face + 2], whole.material))
        else:  # no vertex shared
            loose = whole.vertices[:, whole.triangles.T.ravel()]
            self.meshes.append(Mesh(loose, np.arange(36).reshape(12, 3).T, whole.material))

    def next_box(self) -> None:
        """On the floor, on, beside or through an earlier one, with planes and edges in common."""
        size = self.wholes([1, 1, 1], [3, 3, 3]) / self.pick((1, 1, 2))
        low = self.wholes([-3, 0, -3], [2, 0, 2])
        if self.boxes and self.chance(0.6):
            before, after = self.pick(self.boxes)
            low, axis = before.copy(), int(self.rng.integers(3))
            low[axis] = after[axis]  # its plane
            low += self.wholes([-1, 0, -1], [1, 0, 1]) * (np.arange(3) != axis) * self.pick((0, 0, 1, 0.5))
        if self.chance(0.08):
            low[1] -= self.pick((0.5, 1.0))
        self.box(low, low + size)

    def sheet(self, thickness: float) -> None:
        """Paper, a slab or a pane: on the floor, on a box, floating or upright."""
        size = self.wholes([1, 1], [3, 3])
        at = self.wholes([-2, 0, -2], [1, 3, 1])
        if self.chance(0.5):
            at[1] = 0.0
        elif self.boxes and self.chance(0.6):
            low, high = self.pick(self.boxes)
            at = np.array((low[0], high[1], low[2]))
            size = np.array((high - low)[[0, 2]]) if self.chance(0.4) else size
        if self.chance(0.3):  # upright
            low, high = at, at + np.array((thickness, size[0], size[1]))
        else:
            low, high = at, at + np.array((size[0], thickness, size[1]))
        if self.chance(0.6):
            self.box(low, high)
        else:
            self.level((low[0], high[0]), (low[2], high[2]), float(high[1]))

    def decal(self) -> None:
        """In the plane of a box's top, or of the floor."""
        y = float(self.pick(self.boxes)[1][1]) if self.boxes and self.chance(0.7) else 0.0
        x, z = self.wholes([-2, -2], [1, 1])
        self.level((x, x + self.whole(1, 2)), (z, z + self.whole(1, 2)), y)

    def twice(self) -> None:
        """A mesh, or one triangle of it, given again."""
        if not self.meshes:
            return
        one = self.pick(self.meshes)
        k = int(self.rng.integers(one.triangles.shape[1]))
        self.meshes.append(one if self.chance(0.4) else Mesh(one.vertices, one.triangles[:, k : k + 1], one.material))

    def triangle(self, *corners: Floats) -> None:
        self.meshes.append(Mesh(np.stack(corners, axis=1), np.array([[0], [1], [2]]), self.material()))

    def needle(self) -> None:
        """A triangle far longer than it is wide."""
        a, along = self.wholes([-2, 0, -2], [2, 3, 2]), self.pick(AXES)
        across = self.pick([v for v in AXES if v @ along == 0])
        if self.chance(0.4):
            along = along + self.wholes([-1, 0, -1], [1, 1, 1]) / 2
        self.triangle(a, a + along * self.whole(1, 3), a + across * self.small(-6, -1))

    def tetrahedron(self) -> None:
        """Closed, faces outwards."""
        a, b, c, d = (self.wholes([-2, 0, -2], [2, 3, 2]) for _ in range(4))
        if np.linalg.det(np.stack((b - a, c - a, d - a))) > 0:
            b, c = c, b
        faces = np.array([(0, 1, 2), (0, 3, 1), (0, 2, 3), (1, 3, 2)]).T
        self.meshes.append(Mesh(np.stack((a, b, c, d), axis=1), faces, self.material()))

    def ball(self) -> None:
        """A sphere or an ellipsoid: touching, equal to, inside of or cut by what is there."""
        r = self.pick((0.5, 0.5, 1.0, 1.5))
        at = np.array((self.whole(-2, 2), r, self.whole(-2, 2)))  # touches the floor
        way = self.rng.random()
        if self.ellipsoids and way < 0.35:
            other = self.pick(self.ellipsoids)
            size = abs(other.axes[0][0]) or 1.0
            step = self.pick((size + r, size + r, size - r, 0.0, size / 2)) * self.pick(AXES)
            at, r = np.array(other.center) + step, (size if not step.any() else r)
        elif self.boxes and way < 0.5:
            low, high = self.pick(self.boxes)
            at = np.array((low[0], high[1] + r, low[2]))
        elif way < 0.6:
            at[1] = self.pick((0.0, r / 2, r + 1.0))
        axes = np.eye(3) * r
        if self.chance(0.35):
            axes = np.diag(self.rng.choice([0.25, 0.5, 1.0, 2.0], 3)) * r
            if self.chance(0.4):
                axes = np.linalg.qr(self.rng.normal(size=(3, 3)))[0] @ axes
        made = Ellipsoid(tuple(at), rows(axes), self.material())
        self.ellipsoids.append(made)

    def light(self, corner: Any, ab: Any, ac: Any, towards: Any) -> None:
        """A parallelogram that shines towards a direction."""
        u, v = np.asarray(ab, dtype=float), np.asarray(ac, dtype=float)
        if -np.cross(u, v) @ np.asarray(towards, dtype=float) < 0:
            u, v = v, u
        radiance = tuple(float(self.pick((1.0, 2.0, 3.0, 5.0, 8.0))) for _ in range(3))
        self.lights.append(QuadLight(tuple(corner), tuple(u), tuple(v), radiance))  # type: ignore[arg-type]
