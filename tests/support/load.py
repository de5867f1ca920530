"""Many small checks in one process, several commands at once, and a big image: how memory and file handles grow.

    python tests/support/load.py --checks 10000 --at-once 8 --side 4096

The small checks draw 16 x 16 pixels of ever other scenes and judge them against a reference that is made once; the
commands at once are whole ones, Mitsuba's child included.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
from builders import box, floor, lamp, scene

from nusselt.experiments.check.check import Progress, References, check
from nusselt.experiments.check.question import Question
from nusselt.mitsuba_bridge.reference import Reference
from nusselt.renderer.estimators import ControlVariate
from nusselt.renderer.image import render
from nusselt.renderer.scene import Camera, Scene


class OneReference(References):
    """The same for every scene: what is judged here is not the image."""

    def __init__(self, made: Reference) -> None:
        super().__init__()
        self.made = made

    def get(self, scene: Scene, question: Question, target: float, progress: Progress | None) -> Reference:
        """It."""
        return self.made


def pictured(number: int) -> Scene:
    """A box under a lamp, from another place each time."""
    camera = Camera((0.001 * (number % 1000), 3.0, 6.0 + 1e-4 * number), (0.0, 0.5, 0.0), (0.0, 1.0, 0.0), 40.0)
    return scene(floor(), box((-0.3, 0.2, -0.3), (0.3, 0.8, 0.3)), lights=(lamp(),), size=(16, 16), camera=camera)


def resident() -> int:
    """Bytes of this process in memory."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def handles() -> int:
    """Open files of this process."""
    return len(os.listdir("/proc/self/fd"))


def small_checks(count: int, marks: int = 10) -> list[tuple[int, int, int]]:
    """(checks, bytes resident, open files), ``marks`` times over."""
    estimator = ControlVariate(samples=4, stratified=True)
    reference = Reference.of_image(render(pictured(0), estimator, passes=32), "ours", 4)
    question = Question(estimator="control-variate", samples=4, stratified=True, margin=0.05)
    found = []
    for number in range(1, count + 1):
        answer = check(pictured(number), question, command="", references=OneReference(reference))
        assert answer.verdict is not None
        if number % max(count // marks, 1) == 0:
            found.append((number, resident(), handles()))
    return found


def at_once(count: int) -> tuple[list[int], float]:
    """Exit statuses of so many commands started together, and the seconds all of them took."""
    words = [sys.executable, "-m", "nusselt", "check", "quad-stratified", "--json", "-"]
    started = time.monotonic()
    running = [
        subprocess.Popen([*words, "--seed", str(seed)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        for seed in range(count)
    ]
    return [one.wait() for one in running], time.monotonic() - started


def main() -> int:
    """Three lines, or more; 1 if anything grew or failed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--checks", type=int, default=10_000)
    parser.add_argument("--at-once", type=int, default=8)
    parser.add_argument("--side", type=int, default=4096)
    asked = parser.parse_args()
    wrong = False
    if asked.checks:
        started = time.monotonic()
        marks = small_checks(asked.checks)
        for number, memory, files in marks:
            print(f"{number} checks: {memory / 1e6:.1f} MB, {files} open files")
        print(f"{(time.monotonic() - started) / asked.checks * 1e3:.1f} ms a check")
        wrong |= marks[-1][2] > marks[0][2] or marks[-1][1] > marks[0][1] + 20e6
    if asked.at_once:
        statuses, seconds = at_once(asked.at_once)
        print(f"{asked.at_once} commands at once: exit statuses {statuses}, {seconds:.0f} s")
        wrong |= any(statuses)
    if asked.side:
        made = pictured(0).with_(width=asked.side, height=asked.side)
        started = time.monotonic()
        image = render(made, ControlVariate(samples=4, stratified=True))
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
        print(f"{asked.side} x {asked.side}: peak {peak / 1e9:.2f} GB, {time.monotonic() - started:.0f} s")
        wrong |= not bool(np.isfinite(image.mean).all())
    return int(wrong)


if __name__ == "__main__":
    sys.exit(main())
