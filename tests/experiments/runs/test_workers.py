"""Workers that die cost time, not results."""

import os
import signal
import subprocess
import sys
import time
from concurrent.futures import wait
from pathlib import Path

import pytest

from nusselt.experiments import workers
from nusselt.experiments.workers import LIVES, SturdyPool, worker_pool
from nusselt.renderer.errors import WorkerLost


def die_once(number: int, folder: str) -> int:
    """Kill the own process the first time that three of the numbers are asked for."""
    mark = Path(folder) / str(number)
    if number % 4 == 1 and not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return number * number


def die(folder: str) -> None:
    (Path(folder) / f"{len(list(Path(folder).iterdir()))}").touch()
    os.kill(os.getpid(), signal.SIGKILL)


def refuse() -> None:
    raise ValueError("no")


def process_number(folder: str) -> None:
    (Path(folder) / str(os.getpid())).touch()


KILLED = """
import os, signal, sys
sys.path.insert(0, {tests!r})
from nusselt.experiments.workers import SturdyPool
from test_workers import process_number

if __name__ == "__main__":
    SturdyPool(1).submit(process_number, {folder!r}).result()
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_workers_end_with_a_parent_that_was_killed(tmp_path):
    (tmp_path / "names").mkdir()
    script = tmp_path / "script.py"
    script.write_text(KILLED.format(tests=str(Path(__file__).parent), folder=str(tmp_path / "names")))
    assert subprocess.run([sys.executable, script], check=False).returncode == -signal.SIGKILL
    (name,) = (path.name for path in (tmp_path / "names").iterdir())
    until = time.monotonic() + 30
    while Path(f"/proc/{name}").exists() and time.monotonic() < until:
        time.sleep(0.05)
    assert not Path(f"/proc/{name}").exists()


def rest(folder: str) -> None:
    """A long job, which says that it has begun and that it has ended."""
    (Path(folder) / "begun").touch()
    time.sleep(40)
    (Path(folder) / "ended").touch()


def test_what_interrupts_a_command_waits_for_no_job(tmp_path, monkeypatch):
    monkeypatch.setattr(workers, "cores", lambda: 2)
    with pytest.raises(KeyboardInterrupt), worker_pool() as pool:  # noqa: PT012
        future = pool.submit(rest, str(tmp_path))
        until = time.monotonic() + 30
        while not (tmp_path / "begun").exists() and time.monotonic() < until:
            time.sleep(0.05)
        raise KeyboardInterrupt
    assert [path.name for path in tmp_path.iterdir()] == ["begun"]
    assert future.cancelled()


@pytest.fixture(scope="module")
def pool():
    made = SturdyPool(2)
    yield made
    made.shutdown(cancel_futures=True)


def test_killed_workers_lose_nothing(pool, tmp_path):
    futures = [pool.submit(die_once, number, str(tmp_path)) for number in range(10)]
    assert [future.result(timeout=60) for future in futures] == [number * number for number in range(10)]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["1", "5", "9"]


def test_work_that_always_kills_its_worker_ends_in_one_clear_error(pool, tmp_path):
    with pytest.raises(WorkerLost, match="died 3 times in a row"):
        pool.submit(die, str(tmp_path)).result(timeout=60)
    assert len(list(tmp_path.iterdir())) == LIVES


def test_ordinary_errors_come_back_as_they_are(pool):
    with pytest.raises(ValueError, match="no"):
        pool.submit(refuse).result(timeout=60)


def test_a_pool_that_was_shut_down_cancels_what_comes_after():
    pool = SturdyPool(1)
    pool.shutdown()
    future = pool.submit(refuse)
    assert wait([future], timeout=5).done == {future}
    assert future.cancelled()
