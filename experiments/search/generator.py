"""Random valid scenes by kind and number; the same ones for the same seed."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from nusselt.experiments.scenes.shapes import box
from nusselt.renderer.errors import InputError
from nusselt.renderer.scene import Camera, Scene
from nusselt.renderer.surfaces import Mesh

from .lamps import lamps
from .motions import Motion, carried, turn
from .things import Maker

SIDE = 24
"""Pixels."""
TRIES = 20


def _boxes(m: Maker) -> None:
    m.floor()
    for _ in range(int(m.rng.integers(1, 5))):
        m.next_box()
    if m.chance(0.3):
        m.wall()
    lamps(m)


def _sheets(m: Maker) -> None:
    m.floor()
    if m.chance(0.5):
        m.next_box()
    for _ in range(int(m.rng.integers(1, 4))):
        m.sheet(m.small(-12, -1))
    if m.chance(0.4):
        m.decal()
    lamps(m)


def _coincident(m: Maker) -> None:
    """Decals, and things given twice."""
    m.floor()
    for _ in range(int(m.rng.integers(1, 3))):
        m.pick((m.next_box, m.next_box, m.needle, m.ball))()
    for _ in range(int(m.rng.integers(1, 4))):
        m.pick((m.decal, m.twice))()
    lamps(m)


def _room(m: Maker) -> None:
    """Closed; seen from inside, lit from inside or outside."""
    half, height = m.pick((2.0, 3.0, 4.0)), m.pick((3.0, 4.0))
    m.meshes.append(box((-half, 0, -half), (half, height, half), m.material(), inwards=m.chance(0.85)))
    for _ in range(int(m.rng.integers(0, 3))):
        m.pick((m.next_box, m.ball, lambda: m.sheet(m.small(-8, -1))))()
    lamps(m, height if m.chance(0.8) else height + 2)


def _balls(m: Maker) -> None:
    if m.chance(0.8):
        m.floor()
    if m.chance(0.3):
        m.next_box()
    for _ in range(int(m.rng.integers(1, 5))):
        m.ball()
    lamps(m)


def _soup(m: Maker) -> None:
    if m.chance(0.6):
        m.floor()
    for _ in range(int(m.rng.integers(2, 9))):
        way = m.rng.random()
        if way < 0.35:
            m.triangle(*(m.wholes([-3, 0, -3], [3, 4, 3]) for _ in range(3)))
        elif way < 0.5:
            m.triangle(*(m.rng.uniform([-3, 0, -3], [3, 4, 3]) for _ in range(3)))
        else:
            m.pick((m.needle, m.tetrahedron, m.tetrahedron, m.twice))()
    lamps(m)


def _glossy(m: Maker) -> None:
    m.shiny = 0.9
    m.floor()
    for _ in range(int(m.rng.integers(1, 4))):
        m.pick((m.next_box, m.ball, m.ball, m.tetrahedron, m.wall))()
    lamps(m)


def _mixed(m: Maker) -> None:
    m.floor()
    for _ in range(int(m.rng.integers(2, 6))):
        things = (
            m.next_box,
            m.ball,
            m.wall,
            m.needle,
            m.tetrahedron,
            m.decal,
            m.twice,
            lambda: m.sheet(m.small(-9, -1)),
        )
        m.pick(things)()
    lamps(m)


def _any(m: Maker) -> None:
    m.pick((_boxes, _room, _balls, _sheets))(m)


KINDS: dict[str, Callable[[Maker], None]] = {
    "boxes": _boxes,
    "sheets": _sheets,
    "coincident": _coincident,
    "room": _room,
    "balls": _balls,
    "soup": _soup,
    "glossy": _glossy,
    "mixed": _mixed,
    "far": _any,
}


@dataclass(frozen=True)
class Made:
    """A scene, and how it was put there."""

    scene: Scene
    kind: str
    number: int
    placed: str


def random_scene(kind: str, number: int, seed: int) -> Made:
    """Number ``number`` of a kind; what is no valid scene is thrown again."""
    root = np.random.SeedSequence([seed, zlib.crc32(kind.encode()), number])
    for tried in root.spawn(TRIES):
        rng = np.random.default_rng(tried)
        try:
            scene = _thrown(kind, rng).with_(name=f"{kind}-{number}")
            motion, placed = _place(rng)
            return Made(carried(scene, motion), kind, number, placed)
        except InputError:
            continue
    raise InputError("random scene", f"{kind} {number}", f"a valid scene within {TRIES} tries")


def _thrown(kind: str, rng: np.random.Generator) -> Scene:
    m = Maker(rng)
    camera = _camera(m, inside=kind == "room")
    KINDS[kind](m)
    scene = Scene(SIDE, SIDE, camera, tuple(m.meshes), tuple(m.ellipsoids), tuple(m.lights), two_sided=m.chance(0.25))
    return _far_off(scene, m) if kind == "far" else scene


def _camera(m: Maker, inside: bool) -> Camera:
    """Above, or anywhere, even inside of things; of whole coordinates at times."""
    if inside:
        at = m.rng.uniform([-1.9, 0.2, -1.9], [1.9, 2.8, 1.9])
    elif m.chance(0.8):
        direction = m.rng.normal(size=3)
        direction[1] = abs(direction[1]) + 0.2
        at = direction / np.sqrt((direction**2).sum()) * m.rng.uniform(4, 10)
    else:
        at = m.rng.uniform([-4, 0.1, -4], [4, 4, 4])
    if m.chance(0.25):
        at = np.round(at * 2) / 2
    target = m.rng.uniform([-1.5, 0, -1.5], [1.5, 1.5, 1.5])
    return Camera(tuple(at), tuple(target), (0.0, 1.0, 0.0), m.rng.uniform(35, 90))


def _far_off(scene: Scene, m: Maker) -> Scene:
    """Small, at a large distance from the origin, where a floor stays so that nothing brings the rest near it."""
    size, away = m.pick((0.01, 0.1, 0.125, 1.0)), m.wholes([-9, 0, -9], [9, 0, 9]) * 10.0 ** m.whole(1, 3)
    moved = carried(scene, Motion(np.eye(3) * size, away))
    corners = 10 * np.array([[-9, -9, 9, 9], [0, 0, 0, 0], [-9, 9, 9, -9]], dtype=float)
    floor = Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]]).T, m.material())
    return moved.with_(meshes=(*moved.meshes, floor))


def _place(rng: np.random.Generator) -> tuple[Motion, str]:
    """Whole numbers as they are, turned out of their ties, or at other sizes and places."""
    way = rng.random()
    if way < 0.5:
        return Motion.still(), "as made"
    if way < 0.7:
        return turn(rng), "turned"
    if way < 0.75:
        return turn(rng, float(10.0 ** rng.uniform(-15, -3))), "nearly turned"
    if way < 0.85:
        factor = 10.0 ** rng.uniform(-6, 6)
        return Motion.scaling(2.0 ** np.round(np.log2(factor)) if rng.random() < 0.5 else float(factor)), "scaled"
    shift = np.round(rng.uniform(-1, 1, 3) * 10.0 ** rng.uniform(0, 6))
    if way < 0.95:
        return Motion.step(shift), "moved"
    return Motion(turn(rng).matrix, shift), "turned and moved"
