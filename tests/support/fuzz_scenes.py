"""A long fuzz of the scene reader: every input gives a scene or one clear error, in bounded time and memory.

    python tests/support/fuzz_scenes.py --inputs 1000000 --seed 1

Inputs are classic scenes with lines, words and bytes changed, moved, doubled and dropped, and lines made from the
grammar. Each worker may use 2 GiB; an input over a second of processor
time, any other exception and any file written are failures.
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
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
from places import CLASSIC_SCENES

from nusselt.renderer.errors import InputError
from nusselt.renderer.scene_text import read_scene
from nusselt.renderer.scene_text.commands import COMMANDS, REFUSED

SCENES = [path.read_bytes() for path in sorted(CLASSIC_SCENES.glob("*.test"))]
WORDS = (
    *("0", "1", "-1", "+.5", "1e308", "-1e308", "5e-324", "nan", "inf", "1e999", "999999999999999999", "0x10", "1_0"),
    *("on", "off", "direct", "#", "../../x", "/etc/passwd", "a/b.png", "\\", "\x00", "\x1b[2J", "\u202e", "é", "٣"),
    *("65537", "1000000000", "9" * 400, "1" + "0" * 30, "-0", ".", "-", "+", "1e", "1e+5", "\ufeff", "\t", "\r"),
)
SECONDS = 1.0
MEMORY = 2 << 30
LONGEST = 1 << 20
"""Bytes of an input; larger files have tests of their own."""
BATCH = 500


def _line(rng: np.random.Generator) -> bytes:
    name = rng.choice([*COMMANDS, *REFUSED, "vertx", "#"])
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
    lines = SCENES[int(rng.integers(len(SCENES)))].split(b"\n")
    for _ in range(1 + int(rng.geometric(0.4))):
        if lines:
            _mutate(lines, rng)
    return b"\n".join(lines)[:LONGEST]


def _outcome(given: bytes, path: Path) -> tuple[str, float]:
    path.write_bytes(given)
    started = time.process_time()
    try:
        read_scene(path, lenient=len(given) % 2 == 0)
        said = "scene"
    except InputError as error:
        message = str(error)
        said = "error" if message.isprintable() and len(message) < 2000 else "unclear error"
    except Exception:  # every kind is a finding here
        said = traceback.format_exc(limit=-3)
    return said, time.process_time() - started


def batch(seed: int, number: int, count: int) -> dict[str, Any]:
    """Outcomes of ``count`` inputs, the slowest, and what failed."""
    rng = np.random.default_rng([seed, number])
    counts: Counter[str] = Counter()
    slowest, failures = 0.0, []
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "fuzz.test"
        for _ in range(count):
            given = text(rng)
            said, seconds = _outcome(given, path)
            slowest = max(slowest, seconds)
            counts[said if said in ("scene", "error") else "failure"] += 1
            if said not in ("scene", "error") or seconds > SECONDS:
                failures.append(
                    {"input": repr(given[:3000])[:3000], "bytes": len(given), "said": said, "seconds": seconds}
                )
        if sorted(os.listdir(folder)) != ["fuzz.test"]:
            failures.append({"said": f"files written: {os.listdir(folder)}"})
    return {"counts": dict(counts), "slowest": slowest, "failures": failures}


def _limited() -> None:
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, resource.getrlimit(resource.RLIMIT_AS)[1]))


def main() -> int:
    """Run batches on all cores; exit status 1 if any input failed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--inputs", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    counts: Counter[str] = Counter()
    slowest, failures = 0.0, []
    sizes = [min(BATCH, given.inputs - start) for start in range(0, given.inputs, BATCH)]
    with ProcessPoolExecutor(initializer=_limited) as pool:
        for done in pool.map(batch, [given.seed] * len(sizes), range(len(sizes)), sizes):
            counts.update(done["counts"])
            slowest = max(slowest, done["slowest"])
            failures += done["failures"]
            print(f"\r{sum(counts.values()):,} inputs, {len(failures)} failures", end="", file=sys.stderr)
    print(json.dumps({"counts": dict(counts), "slowest_seconds": slowest, "failures": failures[:5]}, indent=1))
    return 1 if failures or not counts else 0


if __name__ == "__main__":
    sys.exit(main())
