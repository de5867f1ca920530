"""Writes experiments/studies/stability/oracles-lights.json: python tests/support/make_light_oracles.py. mpmath alone.

A case: name, light (a kind), args (its numbers, without the colour, which is 1), x, and oracle: the irradiance at x
of a surface whose normal is (0, 0, 1), to 25 digits, for exactly the float64 numbers written.
"""

from __future__ import annotations

import json
from itertools import pairwise
from typing import Any

from mpmath import mp, mpf
from oracle_formulas import angle, clip, cross, dot, edges, plus, total, unit, vector
from places import ROOT

UP = vector([0.0, 0.0, 1.0])
H = (1e-3, 1e-6, 1e-9)


def polygon(corners: Any, x: Any) -> mpf:
    """Of a triangle that shines where its corners run counter-clockwise."""
    rays = [plus(vector(c), vector(x), -1) for c in corners]
    if dot(cross(plus(rays[1], rays[0], -1), plus(rays[2], rays[0], -1)), rays[0]) >= 0:
        return mpf(0)
    return total([angle(a, b) * dot(UP, g) / 2 for a, b, g in edges(clip(rays, UP))])


def rim(centre: Any, normal: Any, radius: mpf) -> mpf:
    """1/2 of the integral of n . (r x dr)/r^2 along a circle's part above the horizon, and along the horizon."""
    e3 = unit(normal)
    e1 = plus(UP, e3, -dot(UP, e3))  # the circle's highest point is at phi = 0
    level = dot(e1, e1) == 0
    e1 = unit(cross(e3, [mpf(1), mpf(0), mpf(0)])) if level else unit(e1)
    e2 = cross(e3, e1)
    rise, height = (mpf(0) if level else radius * dot(e1, UP)), dot(centre, UP)
    if height + rise <= 0:
        return mpf(0)
    reach = mp.pi if height >= rise else mp.acos(-height / rise)

    def at(phi: mpf) -> Any:
        return plus(plus(centre, e1, radius * mp.cos(phi)), e2, radius * mp.sin(phi))

    def density(phi: mpf) -> mpf:
        r, along = at(phi), plus([-mp.sin(phi) * x for x in e1], e2, mp.cos(phi))
        return radius * dot(UP, cross(r, along)) / dot(r, r) / 2

    nearest = mp.atan2(-dot(centre, e2), -dot(centre, e1))
    gap = mp.sqrt(dot(at(nearest), at(nearest))) / radius
    depth = 3 + max(0, int(-mp.log(gap, 2)))
    steps = [nearest + side * mpf(2) ** -k for k in range(-1, depth) for side in (-1, 1)]
    points = [-reach, *sorted({p for p in (*steps, nearest) if -reach < p < reach}), reach]
    value = mp.fsum(mp.quad(density, [a, b], method="gauss-legendre") for a, b in pairwise(points))
    if reach < mp.pi:  # back along the horizon
        last, first = at(reach), at(-reach)
        value += mp.sign(dot(UP, cross(last, first))) * angle(last, first) / 2
    return abs(value)


def disk(centre: Any, normal: Any, radius: float, x: Any) -> mpf:
    to = plus(vector(centre), vector(x), -1)
    return rim(to, vector(normal), mpf(radius)) if dot(vector(normal), to) < 0 else mpf(0)


def sphere(centre: Any, radius: float, x: Any) -> mpf:
    """A ball is the disk within the circle along which its tangents touch."""
    to = plus(vector(centre), vector(x), -1)
    part = 1 - mpf(radius) ** 2 / dot(to, to)
    return rim([part * c for c in to], to, mpf(radius) * mp.sqrt(part))


def mesh(corners: Any, faces: Any, x: Any) -> mpf:
    return mp.fsum(polygon([corners[k] for k in face], x) for face in faces)


def lamp(place: Any, axis: Any, x: Any) -> tuple[mpf, mpf]:
    """Cosine at the surface over the distance's square, and the angle from a lamp's axis."""
    to = plus(vector(place), vector(x), -1)
    return max(dot(UP, unit(to)), mpf(0)) / dot(to, to), angle([-c for c in to], vector(axis))


def cosine(place: Any, normal: Any, x: Any) -> mpf:
    share, off = lamp(place, normal, x)
    return share * max(mp.cos(off), mpf(0))


def spot(place: Any, axis: Any, cutoff: float, begin: float, x: Any) -> mpf:
    share, off = lamp(place, axis, x)
    fall = (mp.radians(mpf(cutoff)) - off) / mp.radians(mpf(cutoff) - mpf(begin))
    return share * min(max(fall, mpf(0)), mpf(1))


def sky(x: Any) -> mpf:
    return +mp.pi


def triangle(a: Any, b: Any, c: Any, x: Any) -> mpf:
    return polygon([a, b, c], x)


FORMULAS = {f.__name__: f for f in (disk, sphere, triangle, mesh, cosine, spot, sky)}
DOWN, SIDE = (0.0, 0.0, -1.0), (-1.0, 0.0, 0.0)
ORIGIN = (0.0, 0.0, 0.0)
Named = tuple[str, str, tuple[Any, ...], Any]


def rounds() -> list[Named]:
    out: list[Named] = [("a disk overhead", "disk", ((0.25, 0, 2), DOWN, 0.5), ORIGIN)]
    out += [("a ball aside", "sphere", ((1, 0.5, 2), 0.5), ORIGIN), ("the sky", "sky", (), ORIGIN)]
    for h in H:
        out += [
            (f"{h:g} below a disk", "disk", ((0.125, 0, h), DOWN, 1.0), ORIGIN),
            (f"{h:g} below a disk's rim", "disk", ((1.0, 0, h), DOWN, 1.0), ORIGIN),
            (f"{h:g} below a disk's plane, beside it", "disk", ((2.0, 0, h), DOWN, 1.0), ORIGIN),
            (f"an upright disk, {h:g} of it above the horizon", "disk", ((2.0, 0, h - 0.5), SIDE, 0.5), ORIGIN),
            (f"an upright disk, {h:g} of it below the horizon", "disk", ((2.0, 0, 0.5 - h), SIDE, 0.5), ORIGIN),
            (f"a disk of {h:g}", "disk", ((0.25, 0.125, 1), DOWN, h), ORIGIN),
            (f"a disk {1 / h:g} away", "disk", ((0.25 / h, 0, 1 / h), DOWN, 1.0), ORIGIN),
            (f"a disk of {1 / h:g}", "disk", ((0.25, 0, 1), DOWN, 1 / h), ORIGIN),
            (f"{h:g} below a ball", "sphere", ((0, 0, 1 + h), 1.0), ORIGIN),
            (f"{h:g} beside a ball", "sphere", ((1 + h, 0, 0), 1.0), ORIGIN),
            (f"a ball, {h:g} of it above the horizon", "sphere", ((2, 0, h - 0.5), 0.5), ORIGIN),
            (f"a ball, {h:g} of it below the horizon", "sphere", ((2, 0, 0.5 - h), 0.5), ORIGIN),
            (f"a ball of {h:g}", "sphere", ((0.25, 0.125, 1), h), ORIGIN),
            (f"a ball {1 / h:g} away", "sphere", ((0.25 / h, 0, 1 / h), 1.0), ORIGIN),
        ]
    return out


def flats() -> list[Named]:
    roof, faces = [(0, 0, 1), (1, 0, 1), (0, 1, 1), (1, 1, 1.5)], [(0, 2, 1), (1, 2, 3)]
    out: list[Named] = [("a bent mesh of two", "mesh", (roof, faces), ORIGIN)]
    for h in H:
        out += [
            (f"{h:g} below a triangle", "triangle", ((-1, -1, h), (0, 1, h), (1, -1, h)), ORIGIN),
            (f"{h:g} below a triangle's plane, beside it", "triangle", ((1, -1, h), (2, 1, h), (3, -1, h)), ORIGIN),
            (
                f"a triangle 1 long, {h:g} wide",
                "triangle",
                ((-0.5, 0.25, 1), (0.5, 0.25 + h, 1), (0.5, 0.25, 1)),
                ORIGIN,
            ),
            (
                f"an upright triangle, {h:g} of it above",
                "triangle",
                ((1, -0.5, h - 1), (1, 0, h), (1, 0.5, h - 1)),
                ORIGIN,
            ),
            (f"a triangle of {h:g}", "triangle", ((0.25, 0, 1), (0.25, h, 1), (0.25 + h, 0, 1)), ORIGIN),
            (f"a triangle {1 / h:g} away", "triangle", ((0, 0, 1 / h), (0, 1, 1 / h), (1, 0, 1 / h)), ORIGIN),
            (f"a bent mesh of {h:g}", "mesh", ([(h * x, h * y, z + 1 - h) for x, y, z in roof], faces), ORIGIN),
            (f"{h:g} below a bent mesh", "mesh", ([(x, y, z - 1 + h) for x, y, z in roof], faces), ORIGIN),
        ]
    return out


def lamps() -> list[Named]:
    out: list[Named] = []
    for h in H:
        out += [
            (f"a spot, {h:g} inside its rim", "spot", ((1 - h, 0, 1), DOWN, 45.0, 30.0), ORIGIN),
            (f"a spot {h:g} above the horizon", "spot", ((1, 0, h), SIDE, 20.0, 10.0), ORIGIN),
            (f"a spot {1 / h:g} away", "spot", ((0, 0.25 / h, 1 / h), DOWN, 20.0, 10.0), ORIGIN),
            (f"{h:g} before a cosine lamp's plane", "cosine", ((1, 0, h), DOWN), ORIGIN),
            (f"a cosine lamp {h:g} above", "cosine", ((0, 0, h), DOWN), ORIGIN),
            (f"a cosine lamp {1 / h:g} away", "cosine", ((0.25 / h, 0, 1 / h), DOWN), ORIGIN),
        ]
    return out


def main() -> None:
    mp.dps = 70
    found = []
    for name, light, args, x in rounds() + flats() + lamps():
        value = FORMULAS[light](*args, x)
        found.append({"name": name, "light": light, "args": args, "x": list(x), "oracle": mp.nstr(value, 25)})
    lines = ",\n".join(json.dumps(case) for case in found)
    (ROOT / "experiments/studies/stability/oracles-lights.json").write_text(f"[\n{lines}\n]\n", encoding="utf-8")


if __name__ == "__main__":
    main()
