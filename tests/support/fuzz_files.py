"""A long fuzz of the readers: every input gives a scene or mesh, or one clear error, in bounded time and memory.

    python tests/support/fuzz_files.py scene --inputs 1000000 --seed 1
    python tests/support/fuzz_files.py obj ply --inputs 50000 --seed 1 --branches

Scenes are classic ones with lines, words and bytes changed, moved, doubled and dropped, and lines made from the
grammar, a third of them plausible; meshes those of `mesh_inputs.py`. Each worker may use 2 GiB; an input over a second
of processor time, any other exception, any warning of NumPy's and any file written are failures. With ``--branches``
every input is read again, traced: how many of the readers' branches were taken, and where the others are.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from branches import Branches
from mesh_inputs import mesh_bytes
from places import CLASSIC_SCENES, ROOT

from nusselt.renderer.errors import InputError
from nusselt.renderer.mesh_files import read_mesh_file
from nusselt.renderer.scene_text import read_scene
from nusselt.renderer.scene_text.commands import COMMANDS, REFUSED

SCENES = [path.read_bytes() for path in sorted(CLASSIC_SCENES.glob("*.test"))]
WORDS = (
    *("0", "1", "-1", "+.5", "1e308", "-1e308", "5e-324", "nan", "inf", "1e999", "999999999999999999", "0x10", "1_0"),
    *(
        "on",
        "off",
        "direct",
        "phong",
        "ggx",
        "cosine",
        "#",
        "//",
        "../../x",
        "/etc/passwd",
        "a/b.png",
        "\\",
        "\x00",
        "\x1b[2J",
        "\u202e",
        "é",
        "٣",
    ),
    *("65537", "1000000000", "9" * 400, "1" + "0" * 30, "-0", ".", "-", "+", "1e", "1e+5", "\ufeff", "\t", "\r"),
)
SECONDS = 1.0
MEMORY = 2 << 30
LONGEST = 1 << 20
"""Bytes of an input; larger files have tests of their own."""
BATCH = 500


PLAUSIBLE = {
    "switch": ("on", "off", "mis"),
    "method": ("hemisphere", "cosine", "brdf"),
    "name": ("direct", "analyticdirect", "raytracer", "pathtracer", "phong"),
    "file": ("m.obj", "a/b.png", "none.ply", "a.png", "flat.obj", "bad.ply"),
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


def _plausible(rng: np.random.Generator) -> bytes:
    name = str(rng.choice([*COMMANDS]))
    numbers = ("0", "1", "2", "3") if name == "tri" else ("0", "1", "2", ".5", "3", "4", "-1")
    words = [str(rng.choice(PLAUSIBLE.get(argument, numbers))) for argument in COMMANDS[name].arguments]
    return " ".join([name.upper() if rng.random() < 0.1 else name, *words]).encode()


def _line(rng: np.random.Generator) -> bytes:
    if rng.random() < 0.33:
        return _plausible(rng)
    name = rng.choice([*COMMANDS, *REFUSED, "vertx", "reflect", "//", "#"])
    count = len(COMMANDS[name].arguments) if name in COMMANDS and rng.random() < 0.8 else int(rng.integers(0, 14))
    return " ".join([name, *rng.choice(WORDS, count)]).encode()


def _mutate(lines: list[bytes], rng: np.random.Generator) -> None:
    """One change, in place."""
    at = int(rng.integers(len(lines)))
    kind = int(rng.integers(9))
    words = lines[at].split()
    if kind == 0:
        lines[at] = _line(rng)
    elif kind == 1:
        lines.insert(at, _line(rng))
    elif kind == 2 and len(lines) > 1:
        del lines[at]
    elif kind == 3:
        lines.insert(int(rng.integers(len(lines) + 1)), lines[at])
    elif kind == 4 and words:
        words[int(rng.integers(len(words)))] = str(rng.choice(WORDS)).encode()
        lines[at] = b" ".join(words)
    elif kind == 5 and words:
        words.insert(int(rng.integers(len(words) + 1)), str(rng.choice(WORDS)).encode())
        lines[at] = b" ".join(words)
    elif kind == 6 and lines[at]:
        changed = bytearray(lines[at])
        changed[int(rng.integers(len(changed)))] = int(rng.integers(256))
        lines[at] = bytes(changed)
    elif kind == 7:
        lines[at] = (lines[at] * int(rng.integers(1, 2000)))[:LONGEST]
    elif kind == 8:
        lines[at:at] = [_line(rng)] * int(rng.integers(1, 500))


def text(rng: np.random.Generator) -> bytes:
    """One input."""
    if rng.random() < 0.02:
        return rng.integers(0, 256, int(rng.integers(2000)), dtype=np.uint8).tobytes()
    if rng.random() < 0.3:
        return b"\n".join([*VIEW, *(_plausible(rng) for _ in range(int(rng.integers(1, 9))))])
    lines = SCENES[int(rng.integers(len(SCENES)))].split(b"\n")
    for _ in range(1 + int(rng.geometric(0.4))):
        if lines:
            _mutate(lines, rng)
    return b"\n".join(lines)[:LONGEST]


MESH_FILES = ("words.py", "surface.py", "polygons.py", "ears.py")
FILES = {
    "scene": (
        "scene_text",
        ("commands.py", "likeness.py", "reader.py", "state.py", "transforms.py", "triangle_pile.py"),
    ),
    "obj": ("mesh_files", ("obj.py", *MESH_FILES)),
    "ply": ("mesh_files", ("ply.py", "ply_header.py", *MESH_FILES)),
}
"""By kind of input: the folder and files that read it."""


def branches_of(kind: str) -> Branches:
    """The branches of a kind's readers."""
    folder, names = FILES[kind]
    return Branches(ROOT / "renderer" / folder / name for name in names)


def made(kind: str, rng: np.random.Generator) -> bytes:
    """One input of a kind."""
    return text(rng) if kind == "scene" else mesh_bytes(kind, rng)


def _read(path: Path, lenient: bool) -> str:
    try:
        if path.suffix == ".test":
            read_scene(path, lenient=lenient)
        else:
            read_mesh_file(path).with_area()
    except InputError as error:
        message = str(error)
        return "error" if message.isprintable() and len(message) < 2000 else "unclear error"
    except Exception:  # every kind is a finding here
        return traceback.format_exc(limit=-3)
    return "read"


def batch(kind: str, seed: int, number: int, count: int, is_traced: bool = False) -> dict[str, Any]:
    """Outcomes of ``count`` inputs, the slowest, what failed, and the branches seen."""
    rng = np.random.default_rng([seed, number])
    counts: Counter[str] = Counter()
    slowest, failures, branches = 0.0, [], branches_of(kind)
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        path = Path(folder) / f"fuzz.{'test' if kind == 'scene' else kind}"
        for name, content in BESIDE.items():
            (Path(folder) / name).write_bytes(content)
        for _ in range(count):
            given = made(kind, rng)
            path.write_bytes(given)
            started = time.process_time()
            said = _read(path, lenient=len(given) % 2 == 0)
            seconds = time.process_time() - started
            slowest = max(slowest, seconds)
            counts[said if said in ("read", "error") else "failure"] += 1
            if said not in ("read", "error") or seconds > SECONDS:
                failures.append(
                    {"input": repr(given[:3000])[:3000], "bytes": len(given), "said": said, "seconds": seconds}
                )
            if is_traced:
                branches.run(partial(_read, path, lenient=len(given) % 2 == 0))
        if set(os.listdir(folder)) != {path.name, *BESIDE}:
            failures.append({"said": f"files written: {os.listdir(folder)}"})
    return {"counts": dict(counts), "slowest": slowest, "failures": failures, "branches": branches.seen}


def _limited() -> None:
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, resource.getrlimit(resource.RLIMIT_AS)[1]))


def fuzz(kind: str, inputs: int, seed: int, is_traced: bool) -> bool:
    """Run batches of one kind on all cores, and print what happened; whether all went well."""
    counts: Counter[str] = Counter()
    slowest, failures, branches = 0.0, [], branches_of(kind)
    sizes = [min(BATCH, inputs - start) for start in range(0, inputs, BATCH)]
    with ProcessPoolExecutor(initializer=_limited) as pool:
        jobs = [pool.submit(batch, kind, seed, number, size, is_traced) for number, size in enumerate(sizes)]
        for job in jobs:
            done = job.result()
            counts.update(done["counts"])
            slowest = max(slowest, done["slowest"])
            failures += done["failures"]
            branches.seen |= done["branches"]
            print(f"\r{kind}: {sum(counts.values()):,} inputs, {len(failures)} failures", end="", file=sys.stderr)
    said = {"kind": kind, "counts": dict(counts), "slowest_seconds": slowest, "failures": failures[:5]}
    if is_traced:
        said["branches"] = f"{len(branches.seen)} of {len(branches.lines)}"
        said["not taken both ways"] = branches.missed()
    print(json.dumps(said, indent=1))
    return bool(counts) and not failures


def main() -> int:
    """Exit status 1 if any input failed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kinds", nargs="+", choices=FILES)
    parser.add_argument("--inputs", type=int, default=10_000, help="of each kind")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--branches", action="store_true", help="trace, and count the readers' branches")
    given = parser.parse_args()
    well = [fuzz(kind, given.inputs, given.seed, given.branches) for kind in given.kinds]
    return 0 if all(well) else 1


if __name__ == "__main__":
    sys.exit(main())
