"""Small scenes at and beyond the range in which Mitsuba is right: right images of ours are never to be called wrong."""

from __future__ import annotations

HEAD = "size {size}\ncamera {camera}\nintegrator direct\nlightsamples 16\nlightstratify on\ndiffuse .5 .4 .3\n"
CAMERA = "0 1 6  0 0.5 0  0 1 0  40"
LAMP = "quadLight -0.5 3 -0.5  0 0 1  1 0 0  20 20 20\n"
DOWN = "0 5 0.01  0 0 0  0 0 -1  50"


def quad(a: str, b: str, c: str, d: str, first: int) -> str:
    """Two triangles, their vertices numbered from ``first``."""
    corners = "".join(f"vertex {v}\n" for v in (a, b, c, d))
    return f"{corners}tri {first} {first + 1} {first + 2}\ntri {first} {first + 2} {first + 3}\n"


def level(half: float, y: float, first: int, middle: tuple[float, float] = (0, 0)) -> str:
    """A square that faces up."""
    x, z = middle
    low, high, back, front = x - half, x + half, z - half, z + half
    return quad(f"{low} {y} {front}", f"{high} {y} {front}", f"{high} {y} {back}", f"{low} {y} {back}", first)


PLATE = level(0.5, 0.5, 4)
TABLE = level(3, 0, 0) + PLATE
BALL = "sphere 0 .5 0 .5\n"
RED = "diffuse .8 .1 .1\n"


def grid_of_lights(side: int) -> str:
    step = 5 / side
    return "".join(
        f"quadLight {-2.5 + step * i} {2 + 0.1 * ((7 * i + 3 * j) % 10)} {-2.5 + step * j} 0 0 .2 .2 0 0 2 2 2\n"
        for i in range(side)
        for j in range(side)
    )


BODIES: dict[str, str] = {
    # Far larger than what is seen.
    "ground-1e4": level(1e4, 0, 0) + PLATE + LAMP,
    "ground-1e6": level(1e6, 0, 0) + PLATE + LAMP,
    "ground-1e9": level(1e9, 0, 0) + PLATE + LAMP,
    "ground-aside": level(1e6, 0, 0, (9e5, -9e5)) + PLATE + LAMP,
    "ground-blade": level(1e6, 0, 0) + quad("-.5 .1 .3", ".5 .1 .3", ".5 .1 -.3", "-.5 .1 -.3", 4) + LAMP,
    "planet-6e6": "sphere 0 -6e6 0 6e6\n" + BALL + LAMP,
    "planet-1e3": "sphere 0 -1e3 0 1e3\n" + BALL + LAMP,
    "planet-sheared": "pushTransform\ntranslate 0 -1e5 0\nscale 2e5 1e5 3e5\nsphere 0 0 0 1\npopTransform\n"
    + BALL
    + LAMP,
    "sky-ball": TABLE + "sphere 0 0 0 1e5\n" + LAMP,
    "far-wall": level(3, 0, 0)
    + PLATE
    + quad("-1e6 -1e6 -1e6", "1e6 -1e6 -1e6", "1e6 1e6 -1e6", "-1e6 1e6 -1e6", 8)
    + LAMP,
    "far-light": TABLE + "quadLight -50000 300000 -50000  0 0 1e5  1e5 0 0  20 20 20\n",
    "far-point": TABLE + "point 1e5 2e5 1e5 1e11 1e11 1e11\n",
    "far-blocker": level(3, 0, 0)
    + level(2e3, 1e4, 4, (1500, 0))
    + "quadLight -1e4 1e5 -1e4  0 0 2e4  2e4 0 0  20 20 20\n",
    "ground-sunlit": level(1e6, 0, 0) + PLATE + "directional 1 2 .5 3 3 3\n",
    "ground-sun": level(1e6, 0, 0) + PLATE + "sun 1 2 .5 3 3 3 0.5\n",
    "ground-point": level(1e6, 0, 0) + PLATE + "point 0 3 1 20 20 20\n",
    # Lights that touch, cross, or lie in what is there.
    "light-through-ball": TABLE + "sphere 0 3 0 .3\n" + LAMP,
    "light-upright-in-floor": TABLE + "quadLight -1.5 -.5 -.5  0 0 1  0 1 0  20 20 20\n",
    "light-on-floor": TABLE + "quadLight -1.5 0 -.5  0 0 1  0 1 0  20 20 20\n",
    "light-flat-in-floor": TABLE + "quadLight -2.5 0 -.5  1 0 0  0 0 1  20 20 20\n" + LAMP,
    "light-flat-over-floor": TABLE + "quadLight -2.5 1e-9 -.5  1 0 0  0 0 1  20 20 20\n" + LAMP,
    "light-in-ceiling": TABLE
    + level(3, 3, 8).replace("tri 8 9 10", "tri 10 9 8").replace("tri 8 10 11", "tri 11 10 8")
    + LAMP,
    "lights-coincide": TABLE + LAMP + LAMP,
    "lights-nearly-coincide": TABLE + LAMP + "quadLight -.7 2.999999999 -.2  0 0 1  1 0 0  20 10 5\n",
    "lights-cross": TABLE + LAMP + "quadLight 0 2.5 -.5  0 0 1  0 1 0  9 9 9\n",
    # Blockers in the gap that Mitsuba leaves before a light.
    "plate-under-point": level(3, 0, 0) + level(0.5, 1, 4) + "point 0 1.0001 0 10 10 10\n",
    "ball-around-point": TABLE + "sphere 0 2 0 .001\npoint 0 2 0 10 10 10\n",
    "plate-under-lamp": level(3, 0, 0) + level(0.25, 2.9995, 4) + LAMP,
    "ball-under-lamp": TABLE + "sphere 0 2.9 0 .0999\n" + LAMP,
    "light-in-ball": level(3, 0, 0) + "sphere 0 1 0 .5\nquadLight -.1 1 -.1  0 0 .2  .2 0 0  20 20 20\n",
    "light-in-box": TABLE
    + level(0.2, 1.9, 8)
    + level(0.2, 2.1, 12)
    + "quadLight -.1 2 -.1  0 0 .2  .2 0 0  20 20 20\n",
    # Ties of what is seen.
    "reverse-of-itself": TABLE + "vertex -1 .2 1.5\nvertex 0 1 1.5\nvertex 1 .2 1.5\ntri 8 9 10\ntri 10 9 8\n" + LAMP,
    "two-colours": TABLE + RED + level(0.5, 0.5, 8) + LAMP,
    "two-balls": level(3, 0, 0) + BALL + RED + BALL + LAMP,
    "nearly-two-colours": TABLE + RED + level(0.7, 1e-9, 8, (1, 1)) + LAMP,
    # Contact, and hardly any light.
    "ball-on-floor": level(3, 0, 0) + BALL + LAMP,
    "paper": level(3, 0, 0) + level(0.5, 1e-4, 4) + LAMP,
    "paper-point": level(3, 0, 0) + level(0.5, 1e-4, 4) + "point 2 1 1 9 9 9\n",
    "sliver-light": TABLE + "quadLight -.5 3 0  0 0 1e-6  1 0 0  1e7 1e7 1e7\n",
    "grazing-light": TABLE + "quadLight -9 .01 -1  0 1e-3 0  0 0 2  1e5 1e5 1e5\n",
    "faces-away": TABLE + "quadLight -0.5 3 -0.5  1 0 0  0 0 1  20 20 20\n",
    "no-light": TABLE,
    "many-lights": level(3, 0, 0) + BALL + grid_of_lights(4),
}
ABOVE = "0 3 5  0 0.3 0  0 1 0  40"
CAMERAS = {
    "two-colours": ABOVE,
    "nearly-two-colours": ABOVE,
    "light-in-ceiling": "0 1 2.9  0 1 0  0 1 0  70",
    "far-wall": "0 1 6  0 1.5 0  0 1 0  40",
}


def text(name: str, size: str = "32 24") -> str:
    """The scene file of one."""
    return HEAD.format(size=size, camera=CAMERAS.get(name, CAMERA)) + BODIES[name]
