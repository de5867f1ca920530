"""Mistakes of the finished image: patterns, lost and shifted pixels, filters, formats, channels."""

from __future__ import annotations

import numpy as np

from nusselt.experiments.independent.steps import Rng
from nusselt.experiments.independent.world import Bools, Floats

from .mistake import Mistake, Step, everywhere, where_shaded


def _pattern(weight: Step) -> Step:
    """A change by 1 + weight(row, column, height, width)."""

    def change(image: Floats) -> Floats:
        height, width = image.shape[1:]
        y, x = np.mgrid[:height, :width]
        return image * (1 + weight(y, x, height, width))

    return where_shaded(change)


def windows(image: Floats, side: int) -> Floats:
    """All pixels of the square about each, (3, h, w, side^2); the edge repeats."""
    reach = side // 2
    wider = np.pad(image, ((0, 0), (reach, reach), (reach, reach)), mode="edge")
    found = np.lib.stride_tricks.sliding_window_view(wider, (side, side), axis=(1, 2))
    return found.reshape(*image.shape, side * side)


def _put(value: Step, *places: tuple[float, float]) -> Step:
    """The step that changes a few pixels, by their places in shares of the image: value(pixel)."""

    def step(image: Floats, shaded: Bools, rng: Rng) -> Floats:
        image = image.copy()
        for down, right in places:
            y, x = int(down * image.shape[1]), int(right * image.shape[2])
            image[:, y, x] = value(image[:, y, x])
        return image

    return step


FLOOR_PLACES = ((0.72, 0.31), (0.81, 0.55), (0.9, 0.42))
"""On the lit floor of the plain scenes."""


def _block(factor: float, down: float, right: float, side: int) -> Step:
    """The step that multiplies a square of pixels."""

    def step(image: Floats, shaded: Bools, rng: Rng) -> Floats:
        image = image.copy()
        y, x = int(down * image.shape[1]), int(right * image.shape[2])
        image[:, y : y + side, x : x + side] *= factor
        return image

    return step


def _repeated(image: Floats) -> Floats:
    """A 16 x 16 tile shows its neighbour."""
    image = image.copy()
    y, x = int(0.7 * image.shape[1]), int(0.3 * image.shape[2])
    image[:, y : y + 16, x : x + 16] = np.roll(image, -16, axis=2)[:, y : y + 16, x : x + 16]
    return image


def _dithered(image: Floats, shaded: Bools, rng: Rng) -> Floats:
    """Eight bits, each pixel rounded up or down by chance; given as radiance."""
    return np.floor(255 * np.clip(image, 0, 1) + rng.random(image.shape)) / 255


def _in_half(image: Floats) -> Floats:
    """Two hundred equal passes added up in float16."""
    total, step = np.zeros(image.shape, np.float16), image.astype(np.float16)
    for _ in range(200):
        total += step
    return total.astype(float) / 200


def _saturated(image: Floats) -> Floats:
    return 1.05 * image - 0.05 * image.mean(axis=0)


PICTURES = (
    Mistake(
        "checkerboard 10 %",
        "every other pixel brighter, the others darker",
        "ball",
        "finished",
        _pattern(lambda y, x, h, w: 0.1 * (1 - 2 * ((x + y) % 2))),
    ),
    Mistake(
        "checkerboard 2 %",
        "every other pixel brighter, the others darker",
        "ball",
        "finished",
        _pattern(lambda y, x, h, w: 0.02 * (1 - 2 * ((x + y) % 2))),
    ),
    Mistake(
        "odd rows 2 %",
        "brighter, and even ones darker",
        "ball",
        "finished",
        _pattern(lambda y, x, h, w: 0.02 * (1 - 2 * (y % 2))),
    ),
    Mistake(
        "odd columns 2 %",
        "brighter, and even ones darker",
        "ball",
        "finished",
        _pattern(lambda y, x, h, w: 0.02 * (1 - 2 * (x % 2))),
    ),
    Mistake(
        "blocks of 2 x 2",
        "a checkerboard of them, 2 %",
        "ball",
        "finished",
        _pattern(lambda y, x, h, w: 0.02 * (1 - 2 * ((x // 2 + y // 2) % 2))),
    ),
    Mistake(
        "gradient 0.5 %",
        "from left to right",
        "floor",
        "finished",
        _pattern(lambda y, x, h, w: 0.005 * (2 * x / (w - 1) - 1)),
    ),
    Mistake(
        "gradient 2 %",
        "from left to right",
        "floor",
        "finished",
        _pattern(lambda y, x, h, w: 0.02 * (2 * x / (w - 1) - 1)),
    ),
    Mistake(
        "gradient down 2 %",
        "from top to bottom",
        "floor",
        "finished",
        _pattern(lambda y, x, h, w: 0.02 * (2 * y / (h - 1) - 1)),
    ),
    Mistake(
        "waves 1 %",
        "three of them across the image",
        "floor",
        "finished",
        _pattern(lambda y, x, h, w: 0.01 * np.sin(6 * np.pi * x / w)),
    ),
    Mistake("three black pixels", "in the lit floor", "ball", "finished", _put(lambda p: 0 * p, *FLOOR_PLACES)),
    Mistake("one black pixel", "in the lit floor", "ball", "finished", _put(lambda p: 0 * p, FLOOR_PLACES[0])),
    Mistake("one pixel 5 % off", "in the lit floor", "ball", "finished", _put(lambda p: 1.05 * p, FLOOR_PLACES[0])),
    Mistake(
        "one pixel ten times as bright", "in the lit floor", "ball", "finished", _put(lambda p: 10 * p, FLOOR_PLACES[0])
    ),
    Mistake("one NaN", "in the lit floor", "ball", "finished", _put(lambda p: p * np.nan, FLOOR_PLACES[0])),
    Mistake("one infinite pixel", "in the lit floor", "ball", "finished", _put(lambda p: p + np.inf, FLOOR_PLACES[0])),
    Mistake("one negative pixel", "in the lit floor", "ball", "finished", _put(lambda p: -p, FLOOR_PLACES[0])),
    Mistake("block 5 % too bright", "8 x 8 pixels", "ball", "finished", _block(1.05, 0.75, 0.4, 8)),
    Mistake("block 1 % too bright", "16 x 16 pixels", "ball", "finished", _block(1.01, 0.7, 0.3, 16)),
    Mistake("a black tile", "16 x 16 pixels are not rendered", "ball", "finished", _block(0.0, 0.7, 0.3, 16)),
    Mistake("a tile twice", "16 x 16 pixels show those beside them", "ball", "finished", everywhere(_repeated)),
    Mistake(
        "a black row", "it is not rendered", "ball", "finished", _pattern(lambda y, x, h, w: -1.0 * (y == int(0.8 * h)))
    ),
    Mistake(
        "a black column",
        "it is not rendered",
        "ball",
        "finished",
        _pattern(lambda y, x, h, w: -1.0 * (x == int(0.4 * w))),
    ),
    Mistake(
        "a column 3 % off", "all of it", "ball", "finished", _pattern(lambda y, x, h, w: 0.03 * (x == int(0.4 * w)))
    ),
    Mistake(
        "a row down",
        "the image is shifted, its first row repeated",
        "ball",
        "finished",
        everywhere(lambda x: np.concatenate((x[:, :1], x[:, :-1]), axis=1)),
    ),
    Mistake(
        "a column to the right",
        "the image is shifted around",
        "ball",
        "finished",
        everywhere(lambda x: np.roll(x, 1, axis=2)),
    ),
    Mistake(
        "two rows exchanged", "in the middle", "ball", "finished", everywhere(lambda x: x[:, _exchanged(x.shape[1])])
    ),
    Mistake("blur 3 x 3", "the mean of a square", "ball", "finished", everywhere(lambda x: windows(x, 3).mean(axis=3))),
    Mistake("blur 5 x 5", "the mean of a square", "ball", "finished", everywhere(lambda x: windows(x, 5).mean(axis=3))),
    Mistake(
        "blur in the floor",
        "the mean of a square, but of lights",
        "floor",
        "finished",
        where_shaded(lambda x: windows(x, 3).mean(axis=3)),
    ),
    Mistake("median 3 x 3", "of a square", "ball", "finished", everywhere(lambda x: np.median(windows(x, 3), axis=3))),
    Mistake(
        "sharpened",
        "a fifth of what a blur takes away is added",
        "ball",
        "finished",
        everywhere(lambda x: 1.2 * x - 0.2 * windows(x, 3).mean(axis=3)),
    ),
    Mistake("sums in half floats", "two hundred passes", "ball", "finished", everywhere(_in_half)),
    Mistake("eight bits, dithered", "given as radiance", "ball", "finished", _dithered),
    Mistake(
        "eight bits, truncated",
        "given as radiance",
        "ball",
        "finished",
        everywhere(lambda x: np.floor(255 * np.clip(x, 0, 1)) / 255),
    ),
    Mistake("cut off at 1", "lights too", "lamp seen", "finished", everywhere(lambda x: np.minimum(x, 1))),
    Mistake(
        "cut off at 0.4",
        "the brightest of the floor",
        "low lamp",
        "finished",
        where_shaded(lambda x: np.minimum(x, 0.4)),
    ),
    Mistake("channels exchanged", "blue for red", "wall", "finished", everywhere(lambda x: x[::-1])),
    Mistake(
        "grey",
        "the channels' mean",
        "wall",
        "finished",
        where_shaded(lambda x: np.repeat(x.mean(axis=0, keepdims=True), 3, axis=0)),
    ),
    Mistake(
        "luminance",
        "a weighted mean of the channels",
        "wall",
        "finished",
        where_shaded(lambda x: np.repeat(np.tensordot([0.2126, 0.7152, 0.0722], x, 1)[None], 3, axis=0)),
    ),
    Mistake(
        "no blue",
        "a channel is lost",
        "wall",
        "finished",
        where_shaded(lambda x: x * np.array([1.0, 1, 0])[:, None, None]),
    ),
    Mistake("more saturation", "5 %", "wall", "finished", where_shaded(_saturated)),
    Mistake(
        "white balance",
        "red 1 % up, blue 1 % down",
        "wall",
        "finished",
        where_shaded(lambda x: x * np.array([1.01, 1, 0.99])[:, None, None]),
    ),
    Mistake("contrast", "5 % about 0.1", "ball", "finished", where_shaded(lambda x: 0.1 + 1.05 * (x - 0.1))),
)


def _exchanged(rows: int) -> list[int]:
    order = list(range(rows))
    k = int(0.75 * rows)
    order[k], order[k + 1] = order[k + 1], order[k]
    return order
