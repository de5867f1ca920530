"""Lights of random scenes: above, standing in planes of what is there, along its edges, tiny, vast, thin."""

from __future__ import annotations

import numpy as np

from nusselt.renderer.lights import DirectionalLight, PointLight

from .things import Maker

DOWN = (0.0, -1.0, 0.0)


def lamps(m: Maker, height: float | None = None) -> None:
    """One to three of them; below a ceiling at ``height``, if there is one."""
    for _ in range(m.pick((1, 1, 1, 1, 2, 2, 3))):
        m.pick((_level, _level, _level, _beside, _beside, _along_edge, _tiny, _vast, _needle, _tilted))(m, height)
    if m.chance(0.06):
        m.lights.append(_without_extent(m))


def _level(m: Maker, height: float | None) -> None:
    """Whole numbers, shining down; of the ceiling's plane, or before it."""
    y = m.whole(3, 7) if height is None else height - m.pick((0.0, 0.0, 0.0, 0.5, 1.0))
    x, z = m.wholes([-3, -3], [2, 2])
    m.light((x, y, z), (m.whole(1, 3), 0, 0), (0, 0, m.whole(1, 3)), DOWN)


def _beside(m: Maker, height: float | None) -> None:
    """Upright, in the plane of a box's side if there is a box; may stand on the floor."""
    low, high = m.pick(m.boxes) if m.boxes else (np.zeros(3), np.ones(3))
    axis = m.pick((0, 2))
    corner = np.array((m.whole(-3, 3), m.whole(0, 2), m.whole(-3, 3)))
    corner[axis] = m.pick((low[axis], high[axis], low[axis] - 1, high[axis] + 2))
    sideways = np.eye(3)[2 - axis]
    m.light(corner, sideways * m.whole(1, 3), (0, m.whole(1, 2), 0), np.eye(3)[axis] * m.pick((-1, 1)))


def _along_edge(m: Maker, height: float | None) -> None:
    """One edge along a box's, or one corner at its."""
    low, high = m.pick(m.boxes) if m.boxes else (np.zeros(3), np.ones(3))
    corner = np.where(m.rng.random(3) < 0.5, low, high)
    axis, other = m.rng.permutation(3)[:2]
    ab, ac = np.eye(3)[axis] * m.pick((1, -1)), np.eye(3)[other] * m.pick((1, -1))
    ab = ab * ((high - low)[axis] if m.chance(0.5) else 1.0)
    m.light(corner, ab, ac, DOWN if m.chance(0.5) else m.rng.normal(size=3))


def _tiny(m: Maker, height: float | None) -> None:
    size = m.small(-6, -1)
    at = m.wholes([-2, 2, -2], [2, 5, 2])
    m.light(at, (size, 0, 0), (0, 0, size), DOWN)


def _vast(m: Maker, height: float | None) -> None:
    """As wide as 1,000, straight above or upright."""
    half = m.pick((6.0, 10.0, 30.0, 100.0, 1000.0))
    if m.chance(0.7):
        m.light((-half, m.whole(3, 6), -half), (2 * half, 0, 0), (0, 0, 2 * half), DOWN)
    else:
        m.light((-m.whole(3, 6), 0, -half), (0, half, 0), (0, 0, 2 * half), (1, 0, 0))


def _needle(m: Maker, height: float | None) -> None:
    at = m.wholes([-2, 2, -2], [2, 4, 2])
    m.light(at, (m.whole(1, 3), 0, 0), (0, 0, m.small(-6, -1)), DOWN)


def _tilted(m: Maker, height: float | None) -> None:
    ab, ac = m.rng.normal(size=(2, 3))
    at = m.rng.uniform([-2, 2, -2], [2, 6, 2])
    m.light(at, ab, ac, -at)


def _without_extent(m: Maker) -> PointLight | DirectionalLight:
    """Off the whole numbers: which side of a shadow's edge a point lies on is no fair question on it."""
    at = m.rng.uniform([-3, 1, -3], [3, 7, 3])
    if m.chance(0.5):
        return PointLight(tuple(at), (10.0, 20.0, 30.0))
    return DirectionalLight(tuple(at), (1.0, 2.0, 3.0))
