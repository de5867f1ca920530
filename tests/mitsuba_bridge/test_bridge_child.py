"""A child that aborts, hangs or babbles becomes a plain sentence, and is gone; so does a useless LLVM."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from builders import floor, lamp, scene

from nusselt.mitsuba_bridge import llvm
from nusselt.mitsuba_bridge import reference as reference_module
from nusselt.mitsuba_bridge.llvm import Backend, backend, find_backend, system_libraries, version_of
from nusselt.mitsuba_bridge.process import Child, ReferenceUnavailable
from nusselt.mitsuba_bridge.reference import GlossyNeedsLLVM, render_reference
from nusselt.renderer.lights import DirectionalLight, SunLight
from nusselt.renderer.scene import Camera
from nusselt.renderer.surfaces import Ellipsoid, Material

pytestmark = pytest.mark.mitsuba

SUNNY = DirectionalLight((0.3, 1.0, 0.2), (1.0, 2.0, 3.0))


def python(code: str, *arguments: str, timeout: float = 20.0, progress=None, library=None):
    child = Child(["-c", code, *arguments], library)
    try:
        return child.answer(timeout, progress)
    finally:
        child.end()


def test_an_abort_is_named():
    with pytest.raises(ReferenceUnavailable, match="SIGABRT") as caught:
        python("import os, sys; print('LLVM ERROR: Cannot select', file=sys.stderr, flush=True); os.abort()")
    assert "Cannot select" in str(caught.value)


def test_a_status_is_told_with_the_last_words():
    with pytest.raises(ReferenceUnavailable, match="status 3: no such luck"):
        python("import sys; print('no such luck', file=sys.stderr); sys.exit(3)")


@pytest.mark.parametrize(
    "code", ["pass", "print('{nonsense')", "print('[1, 2]')", "import sys; sys.stdout.buffer.write(b'\\xff\\x00')"]
)
def test_garbage_is_no_result(code):
    with pytest.raises(ReferenceUnavailable, match="without a result"):
        python(code)


def alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return "Z" not in Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0]


def gone(pid: int, seconds: float = 5.0) -> bool:
    until = time.monotonic() + seconds
    while alive(pid) and time.monotonic() < until:
        time.sleep(0.02)
    return not alive(pid)


NEST = """
import os, pathlib, subprocess, sys, time
inner = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])
pathlib.Path(sys.argv[1]).write_text(f"{os.getpid()} {inner.pid}")
time.sleep(600)
"""


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="needs /proc")
def test_a_hanging_child_is_killed_with_all_it_started(tmp_path):
    before = time.monotonic()
    with pytest.raises(ReferenceUnavailable, match=r"more than 1\.5 s"):
        python(NEST, str(tmp_path / "pids"), timeout=1.5)
    assert time.monotonic() - before < 10
    for pid in map(int, (tmp_path / "pids").read_text().split()):
        assert gone(pid)


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="needs /proc")
def test_ctrl_c_kills_the_child(tmp_path):
    parent = (
        "import sys; from nusselt.mitsuba_bridge.process import Child;"
        "child = Child(['-c', sys.argv[1], sys.argv[2]], None)\n"
        "try: child.answer(60)\nfinally: child.end()"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", parent, NEST, str(tmp_path / "pids")],
        stderr=subprocess.DEVNULL,
        # A test that runs in the background inherits that interrupts are ignored.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )
    until = time.monotonic() + 20
    while not (tmp_path / "pids").exists() and time.monotonic() < until:
        time.sleep(0.05)
    time.sleep(0.1)
    process.send_signal(signal.SIGINT)
    assert process.wait(10) != 0
    for pid in map(int, (tmp_path / "pids").read_text().split()):
        assert gone(pid)


def test_progress_comes_through_among_chatter():
    seen: list[tuple[int, int]] = []
    code = (
        'print(\'hello\'); print(\'{"done": 1, "total": 2}\'); print(\'{"done": 2, "total": 2}\'); print(\'{"a": 1}\')'
    )
    assert python(code, progress=lambda done, total: seen.append((done, total))) == {"a": 1}
    assert seen == [(1, 2), (2, 2)]


def test_much_chatter_on_both_streams_blocks_nothing():
    code = "import sys\nfor k in range(20000): print('x' * 50); print('y' * 50, file=sys.stderr)\nprint('{\"a\": 1}')"
    assert python(code) == {"a": 1}


def told(**changes):
    return {"version": "0", "variant": "llvm_ad_rgb", "llvm": None, "seconds": {}} | changes


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda a: a.pop("mean"), "no mean"),
        (lambda a: a.update(mean=a["mean"][:, :-1]), "no mean of shape"),
        (lambda a: a["standard_error"].fill(np.nan), "not finite"),
        (lambda a: a.pop("pass_means"), "how it sampled"),
        (lambda a: a.update(mean=np.array([{}], dtype=object)), "no arrays"),
    ],
    ids=["missing", "shape", "nan", "passes", "pickle"],
)
def test_arrays_that_are_no_image_are_refused(monkeypatch, spoil, words):
    """A child that answers, but with something else than it was asked for."""
    plane = (6, 8)
    arrays = {name: np.zeros((3, *plane)) for name in ("mean", "standard_error")}
    arrays |= {name: np.zeros(plane) for name in ("pixel_standard_error", "emitter", "background", "holes")}
    arrays |= {"pass_means": np.zeros(32), "samples": np.array(1), "passes": np.array(32)}
    arrays["share"] = np.array(1.0)
    spoil(arrays)

    def answer(job, folder, *_):
        np.savez(folder / "out.npz", **arrays)
        return told(), folder / "out.npz"

    monkeypatch.setattr(reference_module, "run_job", answer)
    made = scene(floor(), lights=(SUNNY,), size=(8, 6))
    fake = Backend("llvm_ad_rgb", None, "a fake")
    with pytest.raises(ReferenceUnavailable, match=words):
        render_reference(made, seed=0, target_relative_se=1, max_samples=64, timeout=5, running=fake)


def test_a_reference_that_takes_too_long_is_ended_and_names_the_option():
    made = scene(floor(), lights=(lamp(),), size=(64, 48))
    with pytest.raises(ReferenceUnavailable, match=r"took more than 0\.05 s .*--timeout"):
        render_reference(made, seed=0, target_relative_se=1e-9, max_samples=1 << 24, timeout=0.05)


def test_a_reference_of_hours_is_what_the_time_allows():
    made = scene(floor(), lights=(lamp(),), size=(64, 48))
    started = time.monotonic()
    seen = render_reference(made, seed=0, target_relative_se=1e-9, max_samples=1 << 24, timeout=20.0)
    assert time.monotonic() - started < 20
    assert seen.passes >= 2
    assert seen.pass_means.size <= seen.passes
    assert any("--timeout" in note for note in seen.notes)


def test_a_garbage_library_is_passed_over(tmp_path):
    fake = tmp_path / "libLLVM.so.99"
    fake.write_bytes(b"this is no library")
    good = backend()
    after = [] if good.llvm is None else [("the right place", good.llvm)]
    found = find_backend([("a wrong place", fake), *after])
    assert "libLLVM.so.99 from a wrong place failed its proof" in found.sentence
    assert found.variant == good.variant


@pytest.mark.parametrize(
    ("code", "words"),
    [
        ("import os; os.abort()", "SIGABRT"),
        ("import time; time.sleep(60)", "took more than"),
        ("print('?')", "without a result"),
    ],
    ids=["aborts", "hangs", "babbles"],
)
def test_a_library_that_breaks_the_process_is_passed_over(monkeypatch, code, words):
    """As LLVM 15 does: the trivial kernels pass, and the first minimum aborts."""
    real = llvm.run_job

    def job(given, folder, variant, library, timeout):
        if library is not None:
            return python(code, timeout=min(timeout, 1.0)), folder
        return real(given, folder, variant, library, timeout)

    monkeypatch.setattr(llvm, "run_job", job)
    found = find_backend([("a trap", Path("libLLVM.so.15"))])
    assert found.variant == "scalar_rgb"
    assert found.llvm is None
    assert words in found.sentence


def test_no_mitsuba_at_all_is_a_sentence(monkeypatch):
    def child(*_):
        raise ReferenceUnavailable("Mitsuba's process ended with status 1: No module named 'mitsuba'")

    monkeypatch.setattr(llvm, "run_job", child)
    with pytest.raises(ReferenceUnavailable, match="No module"):
        find_backend([])


@pytest.mark.parametrize(
    ("name", "version"),
    [
        ("libLLVM.so.23.1", 23),
        ("libLLVM-15.so.1", 15),
        ("libLLVM-14.0.6.so.1", 14),
        ("libLLVM.so.19.1", 19),
        ("libLLVM.so", None),
    ],
)
def test_versions_are_read_from_names(name, version):
    assert version_of(Path("/nowhere") / name) == version


def test_old_system_libraries_are_never_tried(tmp_path):
    for name in ("libLLVM-14.so.1", "libLLVM-15.so.1", "libLLVM-16.so.1", "libLLVM.so.19.1", "libLLVM.so"):
        (tmp_path / name).touch()
    found = system_libraries((str(tmp_path / "libLLVM*.so*"),))
    assert [path.name for path in found] == ["libLLVM.so.19.1", "libLLVM-16.so.1"]


def test_the_library_is_set_before_the_child_imports():
    code = "import os, json; print(json.dumps({'set': os.environ.get('DRJIT_LIBLLVM_PATH')}))"
    assert python(code, library=Path("/some/lib"))["set"] == "/some/lib"
    assert python(code)["set"] is None


def test_the_harness_never_imports_mitsuba():
    code = (
        "import sys; from nusselt.mitsuba_bridge import reference, export, llvm, tolerance;"
        "print(sorted({'mitsuba', 'drjit'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert json.loads(done.stdout.replace("'", '"')) == []


SCALAR = Backend("scalar_rgb", None, "asked for by a test")


@pytest.fixture
def llvm_runs() -> None:
    if backend().variant == "scalar_rgb":
        pytest.skip("no LLVM to compare with")


def test_scalar_rgb_refuses_glossy_scenes():
    made = scene(floor(material=Material((0.5,) * 3, (0.1,) * 3, 5.0)), lights=(SUNNY,))
    with pytest.raises(GlossyNeedsLLVM, match="asked for by a test"):
        render_reference(made, seed=0, target_relative_se=1, max_samples=64, timeout=5, running=SCALAR)


def both_variants(made, **options):
    options = {"target_relative_se": 5e-3, "max_samples": 1024, "timeout": 60} | options
    fast = render_reference(made, seed=0, **options)
    slow = render_reference(made, seed=1, running=SCALAR, **options)
    assert slow.variant == "scalar_rgb"
    off = (slow.mean - fast.mean).mean(axis=0)
    error = np.hypot(np.hypot(slow.pixel_standard_error, fast.pixel_standard_error), 1e-5 * fast.mean.max())
    assert np.abs(off / error).max() < 9  # t with 31 degrees of freedom, 1e-6 over 192 pixels
    assert abs(off.sum()) < 5.5 * np.sqrt((error**2).sum())
    return slow, fast, error


@pytest.mark.usefixtures("llvm_runs")
def test_scalar_rgb_gives_the_same_image():
    ball = Ellipsoid.sphere((0.3, 0.4, 0.2), 0.4, Material((0.9, 0.5, 0.1), emission=(0.0, 0.5, 0.0)))
    sun = SunLight((0.3, 1.0, 0.2), (1.0, 2.0, 3.0), 4.0)
    made = scene(floor(2.0), lights=(lamp(), SUNNY, sun), ellipsoids=(ball,), size=(16, 12))
    slow, fast, error = both_variants(made)
    np.testing.assert_array_equal(slow.emitter, fast.emitter)
    np.testing.assert_array_equal(slow.background, fast.background)
    assert error.mean() < 0.05 * fast.mean.mean()


@pytest.mark.usefixtures("llvm_runs")
def test_scalar_rgb_gives_the_same_boxes():
    made = scene(floor(2.0), lights=(lamp(),), size=(8, 6), spp=4)
    slow, fast, _ = both_variants(made)
    assert np.abs(slow.emitter - fast.emitter).max() < 0.5
    assert set(np.flatnonzero(slow.background == 1)) >= set(np.flatnonzero(fast.background == 1))


def test_scalar_rgb_does_not_see_the_sun_either():
    camera = Camera((0.0, 1.0, 0.0), (0.0, 2.0, 0.0), (0.0, 0.0, 1.0), 20.0)
    made = scene(floor(), lights=(SunLight((0.0, 1.0, 0.0), (1.0, 1.0, 1.0), 4.0),), camera=camera, size=(16, 12))
    seen = render_reference(made, seed=0, target_relative_se=1, max_samples=64, timeout=60, running=SCALAR)
    assert not seen.mean.any()
    assert (seen.background == 1).all()
