"""Small plain scenes, of the kind that somebody's first renderer is tried with."""

from __future__ import annotations

CAMERA = "camera .3 1.7 5.2  0 .5 0  0 1 0  40"
FLOOR = """diffuse .5 .5 .5
vertex -3 0 3
vertex 3 0 3
vertex 3 0 -3
vertex -3 0 -3
tri 0 1 2
tri 0 2 3
"""
WALL = """diffuse .6 .35 .25
vertex -3 2.5 -3
vertex 3 2.5 -3
tri 3 2 5
tri 3 5 4
"""
BALL = "diffuse .2 .35 .55\nsphere .5 .6 0 .6\n"
SHINY_BALL = "diffuse .2 .3 .4\nspecular .4 .4 .4\nshininess 12\nsphere .5 .6 0 .6\nspecular 0 0 0\n"
EGG = """diffuse .3 .5 .3
pushTransform
translate -.6 .7 .2
rotate 0 0 1 30
scale .3 .7 .4
sphere 0 0 0 1
popTransform
"""
LAMP = "quadLight -.6 2.8 -.6  0 0 1.2  1.2 0 0  12 12 11\n"
LOW_LAMP = "quadLight -.6 1.5 -.6  0 0 1.2  1.2 0 0  5 5 4.5\n"
TILTED = "quadLight -2.2 1 -1  0 0 1.4  .6 1.2 0  8 7 5\n"
SHEARED = "quadLight -1.2 2.2 -.5  .7 .2 1  1.3 .1 -.2  9 9 9\n"
SMALL = "quadLight -.05 2.5 -.05  0 0 .1  .1 0 0  900 900 850\n"
SEEN = "quadLight -.6 2.2 -1.2  0 0 1.2  1.2 0 0  8 8 7\n"
BEHIND = "quadLight -.6 1.5 4  0 0 1.2  1.2 0 0  9 9 9\n"
BROAD = "specular .3 .3 .3\nshininess 3\n"
MATT = "specular 0 0 0\n"
AWAY = "quadLight -.6 .2 -1  1.2 0 0  0 1.2 0  6 6 6\n"
LARGE = "quadLight -4 4 -4  0 0 8  8 0 0  1.2 1.3 1.4\n"


def box(first: int, place: str, scale: str, turn: float = 25.0) -> str:
    """Text of a box whose eight vertices begin at number ``first``."""
    corners = [(x, y, z) for z in (1, -1) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    faces = ((0, 1, 2, 3), (5, 4, 7, 6), (4, 0, 3, 7), (1, 5, 6, 2), (3, 2, 6, 7), (4, 5, 1, 0))
    lines = [f"vertex {x} {y} {z}" for x, y, z in corners] + ["pushTransform", f"translate {place}"]
    lines += [f"rotate 0 1 0 {turn:g}", f"scale {scale}"]
    lines += [f"tri {first + a} {first + i} {first + j}" for a, b, c, d in faces for i, j in ((b, c), (c, d))]
    return "\n".join((*lines, "popTransform", ""))


SHADE = "diffuse .4 .4 .4\n" + box(4, "-.3 2.72 0", ".4 .02 .4")
SHEET = """diffuse .4 .4 .4
vertex -.9 1.2 .6
vertex .3 1.2 .6
vertex .3 1.5 -.6
vertex -.9 1.5 -.6
tri 4 5 6
tri 4 6 7
"""
BOX = "diffuse .6 .5 .3\n" + box(4, "-.8 .5 -.2", ".4 .5 .4")


def _scene(*parts: str, samples: int = 16, camera: str = CAMERA) -> str:
    head = f"size 128 96\n{camera}\nintegrator direct\nlightsamples {samples}\nlightstratify on\n"
    return head + "".join(parts)


PLAIN: dict[str, str] = {
    "floor": _scene(FLOOR, LAMP),
    "ball": _scene(FLOOR, LAMP, BALL),
    "box": _scene(FLOOR, LAMP, BOX),
    "wall": _scene(FLOOR, WALL, LAMP, BALL),
    "egg": _scene(FLOOR, LAMP, EGG),
    "low lamp": _scene(FLOOR, LOW_LAMP, BALL),
    "tilted lamp": _scene(FLOOR, TILTED, BALL),
    "sheared lamp": _scene(FLOOR, SHEARED, BOX),
    "small lamp": _scene(FLOOR, SMALL, BALL),
    "tilted lamp and box": _scene(FLOOR, TILTED, BOX),
    "lamp seen": _scene(FLOOR, SEEN, BALL, camera="camera .3 .9 5.2  0 .9 0  0 1 0  40"),
    "lamp behind the eye": _scene(BROAD, FLOOR, MATT, BEHIND, BALL),
    "lamp from behind": _scene(FLOOR, WALL, AWAY),
    "shade": _scene(FLOOR, LAMP, SHADE),
    "sheet": _scene(FLOOR, LAMP, SHEET),
    "large lamp": _scene(FLOOR, LARGE, BALL, BOX),
    "two lamps": _scene(FLOOR, LAMP, TILTED, BALL),
    "point": _scene(FLOOR, "point 1 2.5 1  5 5 5\n", BALL),
    "point and lamp": _scene(FLOOR, "point 2 2 2  3 2 2\n", LAMP, BALL),
    "direction": _scene(FLOOR, "directional 1 2 1.5  .8 .8 .7\n", BOX),
    "direction and lamp": _scene(FLOOR, "directional 1 2 1.5  .4 .4 .5\n", LAMP, BALL),
    "shiny ball": _scene(FLOOR, LAMP, SHINY_BALL),
    "shiny floor": _scene("specular .3 .3 .3\nshininess 20\n", FLOOR, MATT, TILTED, BALL),
    "open sun": _scene(FLOOR, "sun .6 1.5 1  .9 .85 .7  6\n"),
    "sun": _scene(FLOOR, "sun .6 1.5 1  .9 .85 .7  4\n", BALL),
    "wide sun": _scene(FLOOR, "sun .6 1.5 1  .9 .85 .7  20\n", BALL),
}
"""Text by name; a floor and a lamp, and what is added."""
