"""The command under a hostile machine: full disks, odd homes and locales, killed workers, interrupts."""

import contextlib
import os
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from places import ROOT

SCENE = """size 48 36
camera 0 0 -4  0 0 0  0 1 0  45
integrator direct
lightsamples 4
vertex -9 -1 -9
vertex -9 -1  9
vertex  9 -1  9
diffuse .3 .3 .5
tri 0 1 2
quadLight -1 1 -1  0 0 2  2 0 0  5 5 5
"""
NUSSELT = [sys.executable, "-m", "nusselt"]


@pytest.fixture
def place(tmp_path: Path) -> Path:
    folder = tmp_path / "päth with späces 日本"
    folder.mkdir()
    (folder / "my scéne.test").write_text(SCENE)
    return folder


def hears_interrupts() -> None:
    """In the child: a test that runs in the background inherits that interrupts, or a closed terminal, are ignored."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


def environment(**changed: str) -> dict[str, str]:
    """PATH, and where to find the project when it is not installed."""
    return {"PATH": os.environ["PATH"], "PYTHONPATH": str(ROOT), **changed}


def files(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.rglob("*") if path.is_file())


@pytest.mark.parametrize(
    "changed", [{}, {"LC_ALL": "C"}, {"LC_ALL": "tr_TR.UTF-8", "HOME": "/proc/nowhere"}], ids=["bare", "C", "no-home"]
)
def test_any_home_and_locale(place, changed):
    command = [*NUSSELT, "render", "my scéne.test", "-o", "öut.png"]
    done = subprocess.run(command, cwd=place, env=environment(**changed), capture_output=True, check=False)
    assert (done.returncode, done.stderr) == (0, b"")
    assert files(place) == ["my scéne.test", "öut.png"]


@pytest.mark.parametrize("name", ["a.png", "a.exr", "a.npy"])
def test_a_full_disk_is_one_line_and_leaves_nothing(place, name):
    def full() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (400, 400))

    command = [*NUSSELT, "render", "my scéne.test", "-o", name]
    done = subprocess.run(
        command, cwd=place, env=environment(), capture_output=True, check=False, preexec_fn=full, text=True
    )
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert f"output = {name}" in done.stderr
    assert files(place) == ["my scéne.test"]


def test_a_file_where_a_folder_is_wanted(place):
    (place / "out").touch()
    command = [*NUSSELT, "render", "my scéne.test", "-o", "out/a.png"]
    done = subprocess.run(command, cwd=place, env=environment(), capture_output=True, check=False, text=True)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert files(place) == ["my scéne.test", "out"]


ENDINGS = {signal.SIGINT: "interrupted", signal.SIGTERM: "ended by SIGTERM", signal.SIGHUP: "ended by SIGHUP"}


@pytest.mark.parametrize(
    ("delay", "ending"), [(0.3, signal.SIGINT), (1.3, signal.SIGINT), *((None, ending) for ending in ENDINGS)]
)
def test_what_ends_it_leaves_nothing_half_written_and_no_worker(place, delay, ending):
    """At start-up, while workers start, and in the middle of the image."""
    (place / "my scéne.test").write_text(SCENE.replace("size 48 36", "size 96 72"))  # long enough on any machine
    command = [*NUSSELT, "render", "my scéne.test", "--samples", "262144", "-o", "a.png"]
    ours = subprocess.Popen(
        command,
        cwd=place,
        env=environment(),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        start_new_session=True,
        preexec_fn=hears_interrupts,
    )
    assert delay or has_workers(ours.pid)
    time.sleep(delay or 2.0)
    assert ours.poll() is None
    (os.killpg if ending == signal.SIGINT else os.kill)(ours.pid, ending)  # a terminal's goes to all
    _, said = ours.communicate(timeout=60)
    assert ours.returncode != 0
    assert delay or said.decode().splitlines() == [f"nusselt: {ENDINGS[ending]}: what was finished is written"]
    assert files(place) == ["my scéne.test"]
    assert gone(ours.pid), "a worker is left"


def has_workers(group: int, seconds: float = 60.0) -> bool:
    """Whether the first of a group starts workers within some seconds."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        count = 0
        for path in Path("/proc").glob("[0-9]*/stat"):
            with contextlib.suppress(OSError):  # gone meanwhile
                count += path.read_text().rsplit(")", 1)[1].split()[2] == str(group)
        if count > 2:  # beside it and the one that keeps track of what they share
            return True
        time.sleep(0.05)
    return False


def gone(group: int, seconds: float = 5.0) -> bool:
    """Whether the group's last process ends within some seconds."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.05)
    return False
