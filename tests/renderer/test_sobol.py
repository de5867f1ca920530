"""Sobol's points: one in every box, whichever way it is cut, and as many copies as are asked for, each its own."""

from __future__ import annotations

import numpy as np
import pytest

from nusselt.renderer.pixels.sobol import scrambled


@pytest.mark.parametrize("bits", [1, 4, 9])
def test_every_box_of_the_first_two_dimensions_has_one(bits):
    across, down = scrambled(3, 11)[:2, :, : 1 << bits]
    for cut in range(bits + 1):
        box = np.floor(across * 2**cut) * 2 ** (bits - cut) + np.floor(down * 2 ** (bits - cut))
        assert np.array_equal(np.sort(box, axis=1), np.tile(np.arange(1 << bits), (3, 1)))


def test_each_dimension_has_one_in_every_interval_and_none_follows_from_another():
    points = scrambled(4, 8)
    assert np.array_equal(np.sort(np.floor(points * 256)), np.broadcast_to(np.arange(256), points.shape))
    for copy in range(4):
        # Of 256 independent points a correlation has a standard error of 1/16; these are spread more evenly.
        assert np.abs(np.corrcoef(points[:, copy]) - np.eye(4)).max() < 0.25


def test_half_planes_are_told_far_better_than_by_chance():
    """The share that a half-plane has: variance of a mean of 256, for independent ones 1/1024 of one's."""
    turn = np.random.default_rng(1).random((2, 200, 1, 1)) * [[[[2 * np.pi]]], [[[0.3]]]]
    across, down = scrambled(16, 8)[:2] - 0.5
    share = (across * np.cos(turn[0]) + down * np.sin(turn[0]) > turn[1]).mean(axis=2)
    assert share.var(axis=1).mean() < 0.25 / 256 / 8
