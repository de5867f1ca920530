"""A long fuzz of the readers: every input gives a scene, mesh or image, or one clear error, in bounded time and memory.

    python tests/support/fuzz.py pfm png hdr scene --inputs 1000000 --seed 1 --branches
    python tests/support/fuzz.py exr --inputs 1000000 --workers 1 --minutes 30

Inputs are those of `scene_inputs.py`, `mesh_inputs.py` and `image_inputs.py`. Each worker may use 2 GiB; an input of
more than a second of processor time, any other exception, any warning of NumPy's, anything printed, any file written
and a worker that dies are failures. With ``--branches`` the inputs of one batch in 16, and of the first 40, are read
again, traced: how many of the readers' branches were taken, and where the others are.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import resource
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field
from functools import lru_cache, partial
from pathlib import Path
from random import Random
from typing import Any

import scene_inputs
from branches import Branches
from image_inputs import ENDINGS, SIZE, VIEWED, image_bytes
from mesh_inputs import mesh_bytes
from places import ROOT

from nusselt.experiments.images.read import read_image
from nusselt.renderer.errors import InputError
from nusselt.renderer.mesh_files import read_mesh_file
from nusselt.renderer.scene_text import read_scene

SECONDS = 1.0
MEMORY = 2 << 30
BATCH = 500
EACH, FIRST = 16, 40
"""Of how many batches one is traced, after how many."""


@dataclass(frozen=True)
class Kind:
    """What is read.

    Parameters
    ----------
    suffix : str
        Of the file.
    make : callable
        One input.
    read : callable
        Of the file and a number from 0 to 1, which chooses what else is asked.
    readers : tuple of path
        The files that read it.
    beside : mapping
        Other files in its folder.
    """

    suffix: str
    make: Callable[[Random], bytes]
    read: Callable[[Path, float], None]
    readers: tuple[Path, ...]
    beside: Mapping[str, bytes] = field(default_factory=dict)


def _scene(path: Path, choice: float) -> None:
    read_scene(path, lenient=choice < 0.5)


def _mesh(path: Path, choice: float) -> None:
    read_mesh_file(path).with_area()


def _image(path: Path, choice: float) -> None:
    raw = read_image(f"{path}:a" if path.suffix == ".exr" and choice < 0.1 else path, VIEWED)
    if raw.values.shape != (3, *SIZE) or not all(note.isprintable() for note in (*raw.notes, raw.encoding)):
        raise ValueError(f"{raw.values.shape}, {raw.notes}, {raw.encoding}")


def _files(folder: str, *names: str) -> tuple[Path, ...]:
    return tuple(ROOT / folder / f"{name}.py" for name in names)


SURFACES = ("words", "surface", "polygons", "ears")
IMAGES = {
    ".exr": ("exr", "exr_files", "layers", "chroma", "primaries"),
    ".hdr": ("hdr", "rgbe_rows", "primaries"),
    ".pfm": ("pfm",),
    ".png": ("png",),
}
KINDS = {
    "scene": Kind(
        ".test",
        scene_inputs.scene_bytes,
        _scene,
        _files("renderer/scene_text", "commands", "likeness", "reader", "state", "transforms", "triangle_pile"),
        scene_inputs.BESIDE,
    ),
    "obj": Kind(".obj", partial(mesh_bytes, "obj"), _mesh, _files("renderer/mesh_files", "obj", *SURFACES)),
    "ply": Kind(
        ".ply", partial(mesh_bytes, "ply"), _mesh, _files("renderer/mesh_files", "ply", "ply_header", *SURFACES)
    ),
}
KINDS |= {
    ending[1:]: Kind(
        ending,
        partial(image_bytes, ending),
        _image,
        _files("experiments/images/formats", *IMAGES[ending]),
    )
    for ending in ENDINGS
}


@lru_cache
def branches_of(kind: str) -> Branches:
    """The branches of a kind's readers, and those seen in this process."""
    return Branches(KINDS[kind].readers)


def outcome(read: Callable[[], None]) -> str:
    """``read``, ``error``, or what failed."""
    try:
        read()
    except InputError as error:
        message = str(error)
        return "error" if message.isprintable() and len(message) < 2000 else f"unclear error: {message[:300]!r}"
    except Exception:  # every kind is a finding here
        return traceback.format_exc(limit=-3)
    return "read"


def batch(name: str, seed: int, number: int, count: int, is_traced: bool = False) -> dict[str, Any]:
    """Outcomes of ``count`` inputs, the slowest, what failed, and the branches seen."""
    rng, kind = Random(f"{name} {seed} {number}"), KINDS[name]
    counts: Counter[str] = Counter()
    slowest, failures = 0.0, []
    with _folder() as folder, tempfile.TemporaryFile() as printed, _into(printed), warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        path = folder / f"fuzz{kind.suffix}"
        for other, content in kind.beside.items():
            (folder / other).write_bytes(content)
        for k in range(count):
            given = kind.make(rng)
            path.write_bytes(given)
            read = partial(kind.read, path, rng.random())
            started = time.process_time()
            said = outcome(read)
            seconds = time.process_time() - started
            slowest = max(slowest, seconds)
            counts[said if said in ("read", "error") else "failure"] += 1
            if said not in ("read", "error") or seconds > SECONDS:
                at, start = [name, seed, number, k], repr(given[:1000])
                failures.append({"input": at, "bytes": len(given), "start": start, "said": said, "seconds": seconds})
            if is_traced:
                branches_of(name).run(partial(outcome, read))
        if set(os.listdir(folder)) != {path.name, *kind.beside}:
            failures.append({"said": f"files written: {os.listdir(folder)}"})
        if printed.seek(0, os.SEEK_END):
            printed.seek(0)
            failures.append({"input": [name, seed, number], "said": f"printed: {printed.read(300)!r}"})
    seen = branches_of(name).seen if is_traced else set()
    return {"counts": counts, "slowest": slowest, "failures": failures, "branches": seen}


@contextlib.contextmanager
def _folder() -> Iterator[Path]:
    """A folder in memory, where there is one: most of the time goes into opening files elsewhere."""
    memory = Path("/dev/shm")
    with tempfile.TemporaryDirectory(dir=memory if os.access(memory, os.W_OK) else None) as folder:
        yield Path(folder)


@contextlib.contextmanager
def _into(file: Any) -> Iterator[None]:
    """What is printed, by C++ too, goes into a file."""
    kept = [os.dup(1), os.dup(2)]
    for stream in (1, 2):
        os.dup2(file.fileno(), stream)
    try:
        yield
    finally:
        sys.stdout.flush()
        for stream, copy in zip((1, 2), kept, strict=True):
            os.dup2(copy, stream)
            os.close(copy)


def _limited() -> None:
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, resource.getrlimit(resource.RLIMIT_AS)[1]))


def fuzz(name: str, given: argparse.Namespace) -> bool:
    """Run batches of one kind, and print what happened; whether all went well."""
    counts: Counter[str] = Counter()
    slowest, failures, branches, again = 0.0, [], branches_of(name), 0
    sizes = [min(BATCH, given.inputs - start) for start in range(0, given.inputs, BATCH)]
    ends = time.monotonic() + 60 * given.minutes
    with ProcessPoolExecutor(given.workers, initializer=_limited) as pool:
        is_traced = [given.branches and (number < FIRST or number % EACH == 0) for number in range(len(sizes))]
        jobs = [
            pool.submit(batch, name, given.seed, number, size, traced)
            for number, (size, traced) in enumerate(zip(sizes, is_traced, strict=True))
        ]
        for number, job in enumerate(jobs):
            if time.monotonic() > ends:
                break
            try:
                done = job.result()
            except BrokenProcessPool:
                failures.append({"input": [name, given.seed, number], "said": "a worker died"})
                break
            counts.update(done["counts"])
            slowest = max(slowest, done["slowest"])
            failures += done["failures"]
            branches.seen |= done["branches"]
            again += sizes[number] * is_traced[number]
            print(f"\r{name}: {sum(counts.values()):,} inputs, {len(failures)} failures", end="", file=sys.stderr)
        pool.shutdown(cancel_futures=True)
    said = {"kind": name, "inputs": sum(counts.values()), "counts": dict(counts), "slowest_seconds": slowest}
    said |= {"failed": len(failures), "failures": failures[:5]}
    if given.branches:
        said |= {"traced": again, "branches": f"{len(branches.seen)} of {len(branches.lines)}"}
        said["not taken both ways"] = branches.missed()
    print(json.dumps(said, indent=1), flush=True)
    return bool(counts) and not failures


def main() -> int:
    """Exit status 1 if any input failed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kinds", nargs="+", choices=KINDS)
    parser.add_argument("--inputs", type=int, default=10_000, help="of each kind")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--branches", action="store_true", help="trace, and count the readers' branches")
    parser.add_argument("--workers", type=int, default=None, help="processes; as many as there are cores")
    parser.add_argument("--minutes", type=float, default=float("inf"), help="for each kind: then it stops, and says")
    given = parser.parse_args()
    well = [fuzz(name, given) for name in given.kinds]
    return 0 if all(well) else 1


if __name__ == "__main__":
    sys.exit(main())
