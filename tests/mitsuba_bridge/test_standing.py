"""A child that does job after job: the same bits as one that does one, and nothing left of it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from builders import box, floor, lamp, scene
from test_bridge_child import gone

from nusselt.mitsuba_bridge import standing
from nusselt.mitsuba_bridge.llvm import backend
from nusselt.mitsuba_bridge.process import ReferenceUnavailable
from nusselt.mitsuba_bridge.reference import render_reference

pytestmark = pytest.mark.mitsuba


@pytest.fixture
def none_waiting(monkeypatch):
    """No child from elsewhere; those that are left are ended."""
    monkeypatch.setattr(standing, "_waiting", {})
    yield standing._waiting
    for child, _ in standing._waiting.values():
        child.end()


def pids(waiting) -> list[int]:
    return [child.process.pid for child, _ in waiting.values()]


def proof(folder: Path, timeout: float = 60.0, **options) -> None:
    running = backend()
    standing.run_job({"task": "proof"}, folder, running.variant, running.llvm, timeout, **options)


def reference(seed: int, lights: int = 2):
    made = scene(
        floor(),
        box((-0.4, 0.2, -0.4), (0.4, 0.6, 0.4)),
        lights=tuple(lamp(1.0 + k) for k in range(lights)),
        size=(48, 32),
    )
    return render_reference(made, seed=seed, target_relative_se=1e-2, max_samples=1 << 12, timeout=120.0)


def test_what_a_child_did_before_changes_no_bit(none_waiting):
    fresh = reference(7)
    child = pids(none_waiting)
    reference(8, lights=1)
    again = reference(7)
    assert pids(none_waiting) == child
    np.testing.assert_array_equal(again.mean, fresh.mean)
    np.testing.assert_array_equal(again.standard_error, fresh.standard_error)


def test_one_that_failed_or_holds_much_or_waited_long_is_ended(none_waiting, tmp_path, monkeypatch):
    proof(tmp_path)
    (first,) = pids(none_waiting)
    with pytest.raises(ReferenceUnavailable, match=r"KeyError: 'nonsense'"):
        standing.run_job({"task": "nonsense"}, tmp_path, *next(iter(none_waiting))[1:], 60.0)
    assert gone(first)
    assert not none_waiting
    proof(tmp_path)
    (second,) = pids(none_waiting)
    monkeypatch.setattr(standing, "SLACK", standing.IDLE)
    proof(tmp_path)
    (third,) = pids(none_waiting)
    assert gone(second)
    monkeypatch.setattr(standing, "SLACK", 0.0)
    monkeypatch.setattr(standing, "LARGEST", 0)
    proof(tmp_path)
    assert gone(third)
    assert not none_waiting


def test_one_that_was_killed_while_it_waited_is_replaced(none_waiting, tmp_path):
    proof(tmp_path)
    (child,) = pids(none_waiting)
    os.kill(child, signal.SIGKILL)
    next(iter(none_waiting.values()))[0].process.wait(10)
    proof(tmp_path)
    assert pids(none_waiting) != [child]


def test_a_fresh_one_is_asked_for_beside_those_that_wait(none_waiting, tmp_path):
    proof(tmp_path)
    before = pids(none_waiting)
    proof(tmp_path, fresh=True)
    assert pids(none_waiting) == before


PARENT = """
import os, sys
from pathlib import Path
from nusselt.mitsuba_bridge import process, standing
from nusselt.mitsuba_bridge.llvm import backend
running = backend()
real = process.Child.tell
def tell(child, line):
    Path(sys.argv[1]).write_text(str(child.process.pid))
    heard = real(child, line)
    os.kill(os.getpid(), 9)
process.Child.tell = tell
standing.run_job({"task": "proof"}, Path(sys.argv[2]), running.variant, running.llvm, 60.0, fresh=True)
"""


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="needs /proc")
def test_it_ends_with_who_asked(tmp_path):
    done = subprocess.run([sys.executable, "-c", PARENT, str(tmp_path / "pid"), str(tmp_path)], check=False)
    assert done.returncode == -signal.SIGKILL
    assert gone(int((tmp_path / "pid").read_text()))
