"""Scene files for the fuzz: classic ones changed, and lines made from the grammar, a third of them plausible."""

from __future__ import annotations

from random import Random

from places import CLASSIC_SCENES

from nusselt.renderer.scene_text.commands import COMMANDS, REFUSED

SCENES = [path.read_bytes() for path in sorted(CLASSIC_SCENES.glob("*.test"))]
WORDS = (
    *("0", "1", "-1", "+.5", "1e308", "-1e308", "5e-324", "nan", "inf", "1e999", "999999999999999999", "0x10", "1_0"),
    *("on", "off", "direct", "phong", "ggx", "cosine", "#", "//", "../../x", "/etc/passwd", "a/b.png", "\\", "\x00"),
    *("\x1b[2J", "\u202e", "é", "٣", "65537", "1000000000", "9" * 400, "1" + "0" * 30, "-0", ".", "-", "+", "1e"),
    *("1e+5", "\ufeff", "\t", "\r", "mesh", "box", "background"),
)
LONGEST = 1 << 20
"""Bytes of an input; larger files have tests of their own."""
PLAUSIBLE = {
    "switch": ("on", "off", "mis"),
    "method": ("hemisphere", "cosine", "brdf"),
    "name": ("direct", "analyticdirect", "raytracer", "pathtracer", "phong"),
    "file": ("m.obj", "a/b.png", "none.ply", "a.png", "flat.obj", "bad.ply", "..", "a:b"),
    "count": ("1", "4", "9"),
}
"""Words for arguments of those names; numbers for all others."""
BESIDE = {
    "bad.ply": b"ply\nformat ascii 1.0\nend_header\n",
    "flat.obj": b"v 0 0 0\nv 1 1 1\nf 1 2 1\n",
    "m.obj": b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\nf 1 1 2\nvn 0 0 1\n",
}
"""Files beside a scene."""
VIEW = b"size 4 3\ncamera 0 0 4 0 0 0 0 1 0 45\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nvertex 0 0 1".split(b"\n")
_NAMES = [*COMMANDS]
_ALL = [*COMMANDS, *REFUSED, "vertx", "reflect", "//", "#"]


def _plausible(rng: Random) -> bytes:
    name = rng.choice(_NAMES)
    numbers = ("0", "1", "2", "3") if name == "tri" else ("0", "1", "2", ".5", "3", "4", "-1")
    words = [rng.choice(PLAUSIBLE.get(argument, numbers)) for argument in COMMANDS[name].arguments]
    return " ".join([name.upper() if rng.random() < 0.1 else name, *words]).encode()


def _line(rng: Random) -> bytes:
    if rng.random() < 0.33:
        return _plausible(rng)
    name = rng.choice(_ALL)
    count = len(COMMANDS[name].arguments) if name in COMMANDS and rng.random() < 0.8 else rng.randrange(14)
    return " ".join([name, *rng.choices(WORDS, k=count)]).encode()


def _times(rng: Random, most: int) -> int:
    """How often something stands there again: seldom very often, which takes most of the time."""
    return rng.randrange(1, most if rng.random() < 0.05 else 12)


def _mutate(lines: list[bytes], rng: Random) -> None:
    """One change, in place."""
    at = rng.randrange(len(lines))
    kind = rng.randrange(9)
    words = lines[at].split()
    if kind == 0:
        lines[at] = _line(rng)
    elif kind == 1:
        lines.insert(at, _line(rng))
    elif kind == 2 and len(lines) > 1:
        del lines[at]
    elif kind == 3:
        lines.insert(rng.randrange(len(lines) + 1), lines[at])
    elif kind == 4 and words:
        words[rng.randrange(len(words))] = rng.choice(WORDS).encode()
        lines[at] = b" ".join(words)
    elif kind == 5 and words:
        words.insert(rng.randrange(len(words) + 1), rng.choice(WORDS).encode())
        lines[at] = b" ".join(words)
    elif kind == 6 and lines[at]:
        changed = bytearray(lines[at])
        changed[rng.randrange(len(changed))] = rng.randrange(256)
        lines[at] = bytes(changed)
    elif kind == 7:
        lines[at] = (lines[at] * _times(rng, 2000))[:LONGEST]
    elif kind == 8:
        lines[at:at] = [_line(rng)] * _times(rng, 500)


def scene_bytes(rng: Random) -> bytes:
    """One input."""
    if rng.random() < 0.02:
        return rng.randbytes(rng.randrange(2000))
    if rng.random() < 0.4:
        return b"\n".join([*VIEW, *(_plausible(rng) for _ in range(rng.randrange(1, 9)))])
    lines = rng.choice(SCENES).split(b"\n")
    while lines and rng.random() < 0.7:
        _mutate(lines, rng)
    return b"\n".join(lines)[:LONGEST]
