"""Walls that touch a light, seen from within a hair of their planes: what they hide shrinks with the hair."""

from __future__ import annotations

import numpy as np
import pytest
from builders import GREY, scene
from scipy.stats import special_ortho_group
from test_exact import irradiance

from nusselt.renderer.lights import QuadLight
from nusselt.renderer.surfaces import Mesh

WALL = np.array([(-2, 0, -1), (-1, 1, -1), (-1, 1, 1), (-2, 0, 1)], dtype=float).T
"""Shares an edge with the light below, as a second light beside it would; in the plane y = x + 2."""
LIGHT = np.array([(-1, 1, -1), (0, 0, 2), (2, 0, 0)], dtype=float).T
OFFSETS = np.concatenate([sign * 10.0 ** np.arange(-16.0, -0.4, 0.25) for sign in (-1, 1)])


def hidden(turn, seed):
    """What the wall hides of the light (n,), E / L, from points beside its plane."""
    rng = np.random.default_rng(seed)
    along, below = rng.uniform(-3, 3, OFFSETS.size), rng.uniform(-4, -0.5, OFFSETS.size)
    points = np.stack((below - 2 + OFFSETS, below, along))
    corner, ab, ac = (tuple(turn @ v) for v in LIGHT.T)
    light = QuadLight(corner, ab, ac, (1, 1, 1))
    made = scene(Mesh(turn @ WALL, np.array([[0, 0], [1, 2], [2, 3]]), GREY), lights=(light,))
    normal = turn @ np.array([[0.0], [1], [0]])
    free = irradiance(made.with_(meshes=()), turn @ points, normal)
    return free - irradiance(made, turn @ points, normal)


@pytest.mark.parametrize("seed", range(8))
def test_what_a_sliver_hides_shrinks_with_it(seed):
    turn = special_ortho_group.rvs(3, random_state=seed) if seed else np.eye(3)
    dark = hidden(turn, seed)
    assert (dark >= -1e-12).all()
    assert (dark <= 4 * np.abs(OFFSETS) + 1e-12).all()
    assert dark.max() > 1e-3  # the wall is there
