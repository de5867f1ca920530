"""Kill -9 a sweep at random moments, run it again, and compare what it ends with: nothing is lost, nothing is doubled.

    python tests/support/kill_sweep.py --kills 50 --seed 1

Each time in a fresh folder: the sweep and all its processes are killed once, at a moment drawn from the whole of an
undisturbed run, and the same command is given again.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

SWEEP = ("nusselt-analog", "light-units")
APART = ("seconds", "command")


def command(out: Path) -> list[str]:
    """The sweep."""
    return [sys.executable, "-m", "nusselt", "run", *SWEEP, "--quick", "--out", str(out)]


def rows(out: Path) -> list[dict[str, Any]]:
    """What it ended with, clocks and commands apart."""
    found = json.loads((out / "results.json").read_text(encoding="utf-8"))["rows"]
    return [{name: value for name, value in row.items() if name not in APART} for row in found]


def whole(out: Path) -> float:
    """Run it to the end; seconds."""
    started = time.monotonic()
    subprocess.run(command(out), check=True, capture_output=True)
    return time.monotonic() - started


def done(out: Path) -> int:
    """How many jobs are on disk."""
    return len(list((out / "jobs").glob("*.npz")))


def killed(out: Path, when: Callable[[], bool]) -> int:
    """Run it, and kill it with all it started as soon as ``when`` says so; how many jobs it had finished by then."""
    with subprocess.Popen(
        command(out), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True
    ) as running:
        while running.poll() is None and not when():
            time.sleep(0.01)
        if running.returncode is None:
            os.killpg(running.pid, signal.SIGKILL)
    return done(out)


def main() -> int:
    """The figures, one line each; 1 if any sweep ended with other rows."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    rng = np.random.default_rng(asked.seed)
    wrong = 0
    with tempfile.TemporaryDirectory(prefix="nusselt-kill-") as name:
        folder = Path(name)
        seconds = whole(folder / "undisturbed")
        right = rows(folder / "undisturbed")
        for number in range(asked.kills):
            out = folder / str(number)
            after = float(rng.uniform(0, seconds))
            moment = time.monotonic() + after
            jobs = killed(out, lambda moment=moment: time.monotonic() >= moment)
            whole(out)
            same = rows(out) == right
            wrong += not same
            print(f"killed after {after:.2f} of {seconds:.2f} s, {jobs} jobs done: {'same' if same else 'OTHER'} rows")
    print(f"{asked.kills} kills, {wrong} other results, {len(right)} rows each")
    return int(wrong > 0 or not right)


if __name__ == "__main__":
    sys.exit(main())
