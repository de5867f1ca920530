"""The same numbers on a Dask cluster as at home, also when it loses a worker in the middle."""

import json
import os
import signal
import threading
import time

import numpy as np
import pytest
from builders import box, floor, lamp, scene
from click.testing import CliRunner
from distributed import LocalCluster

from nusselt.experiments import workers
from nusselt.experiments.cli.main import main
from nusselt.experiments.workers import worker_pool
from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import Area
from nusselt.renderer.image import render


@pytest.fixture(scope="module")
def dask(tmp_path_factory):
    folder = tmp_path_factory.mktemp("dask")
    with LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=None, local_directory=str(folder)
    ) as cluster:
        yield cluster


@pytest.fixture(scope="module")
def picture():
    return scene(floor(), box((-0.3, 0.2, -0.3), (0.3, 0.8, 0.3)), lights=(lamp(),)).with_(width=256, height=192)


def same(a, b) -> None:
    for name in ("mean", "variance", "pixel_variance", "level_mean", "pass_means", "emitter"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name))


def test_an_image_on_a_cluster_is_the_local_one_bit_for_bit(dask, picture):
    estimator = Area(samples=16, stratified=True)
    with worker_pool(dask.scheduler_address) as executor:
        far = render(picture, estimator, seed=5, passes=3, executor=executor)
    same(far, render(picture, estimator, seed=5, passes=3))


def test_a_lost_worker_changes_nothing(dask, picture):
    estimator = Area(samples=25, stratified=True)
    killed = []

    def kill_one(done: int, total: int) -> None:
        if done == 1:
            pid = next(iter(dask.workers.values())).pid
            os.kill(pid, signal.SIGKILL)
            killed.append((pid, total))

    with worker_pool(dask.scheduler_address) as executor:
        far = render(picture, estimator, seed=5, passes=3, executor=executor, progress=kill_one)
    assert killed
    assert killed[0][1] > 4
    same(far, render(picture, estimator, seed=5, passes=3))


@pytest.fixture
def impatient(monkeypatch):
    monkeypatch.setattr(workers, "ANSWER", 1.0)


@pytest.mark.usefixtures("impatient")
def test_an_address_where_nobody_answers_is_one_clear_error():
    began = time.monotonic()
    with (
        pytest.raises(InputError, match=r"cluster = tcp://127\.0\.0\.1:1: expected"),
        worker_pool("tcp://127.0.0.1:1"),
    ):
        pass
    assert time.monotonic() - began < 60
    assert not [thread for thread in threading.enumerate() if "Profile" in thread.name and not thread.daemon]


def test_experiments_on_a_cluster_find_the_same_rows(dask, tmp_path):
    found = {}
    for place, more in (("here", ()), ("there", ("--cluster", dask.scheduler_address))):
        target = tmp_path / f"{place}.json"
        words = ["run", "random-vs-stratified", "nusselt-analog", "--quick", "--json", str(target), *more]
        result = CliRunner().invoke(main, words)
        assert result.exit_code == 0, result.output
        found[place] = json.loads(target.read_text())["rows"]
    assert found["there"] == found["here"]
    assert len(found["here"]) > 10


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:1", "foo", "tcp://127.0.0.1", "tcp://x y:1"])
@pytest.mark.usefixtures("impatient")
def test_a_command_says_in_one_line_that_no_scheduler_answers(address, tmp_path):
    output = tmp_path / "a.npy"
    words = ["render", "quad", "--cluster", address, "-o", str(output)]
    result = CliRunner().invoke(main, words)
    assert result.exit_code == 2
    assert len(result.stderr.strip().splitlines()) == 1
    assert f"--cluster = {address}" in result.stderr
    assert not output.exists()
