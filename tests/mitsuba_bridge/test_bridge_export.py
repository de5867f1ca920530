"""Exported scenes: XML that Mitsuba reads as it is written, by the stock executable where it can."""

from __future__ import annotations

import os
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pytest
from builders import GREY, floor, lamp, scene

from nusselt.mitsuba_bridge import export
from nusselt.mitsuba_bridge.export import export_scene
from nusselt.mitsuba_bridge.llvm import backend, backend_report
from nusselt.mitsuba_bridge.process import environment
from nusselt.mitsuba_bridge.reference import render_reference
from nusselt.renderer.errors import InputError
from nusselt.renderer.lights import DirectionalLight, PointLight, QuadLight, SunLight
from nusselt.renderer.scene import Camera, Scene
from nusselt.renderer.surfaces import Ellipsoid, Material

pytestmark = pytest.mark.mitsuba

CAMERA = Camera((0.3, 1.6, 2.6), (0.0, 0.2, 0.0), (0.0, 1.0, 0.0), 30.0)
"""Sees surfaces in every pixel: little noise."""
STOCK = Path(sys.executable).parent / "mitsuba"
SHEARED = QuadLight((-0.5, 2.0, -0.4), (0.3, 0.2, 1.0), (1.1, -0.1, 0.2), (4.0, 2.0, 1.0))


def diffuse(**options) -> Scene:
    ball = Ellipsoid.sphere((0.4, 0.3, 0.2), 0.3, Material((0.9, 0.5, 0.1)))
    tilted = Ellipsoid((-0.6, 0.3, 0.0), ((0.3, 0.1, 0.0), (0.0, 0.2, 0.0), (0.0, 0.0, 0.3)), GREY)
    return scene(floor(8.0), ellipsoids=(ball, tilted), lights=(SHEARED,), camera=CAMERA, **options)


def module(*arguments: str) -> subprocess.CompletedProcess:
    return subprocess.run(
        [sys.executable, "-m", "nusselt.mitsuba_bridge", *arguments],
        capture_output=True,
        text=True,
        env=environment(None),
    )


def same_means(xml: Path, made: Scene, image: np.ndarray) -> None:
    """Mitsuba's film of the file against the reference of the same scene, pixels as boxes on both."""
    reference = render_reference(made.with_(spp=4), seed=2, target_relative_se=2e-3, max_samples=4096, timeout=60)
    assert image.shape == (made.height, made.width, 3)
    assert image.mean() == pytest.approx(reference.mean.mean(), rel=0.02)
    # And every quarter of it, so that neither a mirrored nor a turned image passes.
    h, w = made.height // 2, made.width // 2
    for rows in (slice(0, h), slice(h, None)):
        for columns in (slice(0, w), slice(w, None)):
            assert image[rows, columns].mean() == pytest.approx(reference.mean[:, rows, columns].mean(), rel=0.05)


@pytest.mark.skipif(not STOCK.exists(), reason="Mitsuba's own executable is not installed beside Python")
def test_the_stock_executable_loads_a_diffuse_scene(tmp_path):
    made = diffuse()
    notes = export_scene(made, tmp_path / "a scene.xml")
    assert not any("stock" in note for note in notes)
    image = tmp_path / "image.exr"
    done = subprocess.run(
        [STOCK, "-m", "scalar_rgb", "-o", image, tmp_path / "a scene.xml"], capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 0, done.stdout + done.stderr
    openexr = pytest.importorskip("OpenEXR")
    with openexr.File(str(image)) as opened:
        pixels = opened.channels()["RGB"].pixels
    assert pixels.dtype == np.float32
    same_means(tmp_path / "a scene.xml", made, pixels)


def test_a_glossy_scene_says_that_it_needs_the_plugin_and_renders_with_it(tmp_path):
    if backend().variant == "scalar_rgb":
        pytest.skip("the Phong surface is too slow in scalar_rgb")
    made = diffuse().with_(meshes=(floor(8.0, material=Material((0.4, 0.5, 0.6), (0.3, 0.2, 0.1), 20.0)),))
    notes = export_scene(made, tmp_path / "glossy.xml")
    assert any("stock mitsuba executable does not know" in note for note in notes)
    done = module("render", str(tmp_path / "glossy.xml"), "-o", str(tmp_path / "image.npy"), "--samples", "256")
    assert done.returncode == 0, done.stderr
    same_means(tmp_path / "glossy.xml", made, np.load(tmp_path / "image.npy"))


def test_every_kind_of_thing_is_written_with_all_its_digits(tmp_path):
    third = 1 / 3
    lights = (
        SHEARED,
        PointLight((third, 2.0, 0.0), (1.0, third, 2.0)),
        DirectionalLight((1.0, 2.0, third), (third, 0.0, 1e9)),
        SunLight((0.0, 1.0, 0.5), (1.0, 1.0, 1.0), 0.53),
    )
    made = diffuse(two_sided=True).with_(lights=lights)
    export_scene(made, tmp_path / "all.xml")
    root = ElementTree.parse(tmp_path / "all.xml").getroot()
    shapes = [shape.get("type") for shape in root.iter("shape")]
    assert sorted(shapes) == ["disk", "ply", "ply", "rectangle", "sphere"]
    assert [e.get("type") for e in root.findall("emitter")] == ["point", "directional"]
    direction = root.find("emitter[@type='directional']/vector")
    assert direction is not None
    given = np.array([float(direction.get(c, "")) for c in "xyz"])
    assert given.tolist() == [-c for c in lights[2].direction]
    assert root.find("emitter[@type='directional']/rgb").get("value") == f"{third!r} 0.0 {1e9!r}"
    rectangle = np.array(
        [float(v) for v in root.find("shape[@type='rectangle']/transform/matrix").get("value").split()]
    )
    columns = rectangle.reshape(4, 4)[:3].T
    emits = np.cross(columns[0], columns[1])
    assert np.dot(emits / np.linalg.norm(emits), SHEARED.normal) == pytest.approx(1, abs=1e-14)
    for shape in root.iter("shape"):
        if shape.find("emitter") is not None:  # never left to a default
            assert shape.find("bsdf").get("type") == "diffuse"
            assert shape.find("bsdf/rgb").get("value") == "0 0 0"
    assert all(bsdf.get("type") == "twosided" for bsdf in root.findall("bsdf"))
    for shape in root.iter("shape"):
        if shape.get("type") == "ply":
            assert (tmp_path / shape.find("string").get("value")).is_file()


def test_names_are_escaped(tmp_path):
    target = tmp_path / "a&b <\"c'>.xml"
    export_scene(diffuse(), target)
    root = ElementTree.parse(target).getroot()
    for shape in root.iter("shape"):
        if shape.get("type") == "ply":
            assert (tmp_path / shape.find("string").get("value")).is_file()


def test_nothing_half_written_is_left(tmp_path, monkeypatch):
    target = tmp_path / "scene.xml"
    target.write_text("before", encoding="utf-8")

    def breaks(*_):
        raise OSError(28, os.strerror(28))

    monkeypatch.setattr(export, "to_xml", breaks)
    with pytest.raises(InputError, match="No space left"):
        export_scene(diffuse(), target)
    assert [path.name for path in tmp_path.iterdir()] == ["scene.xml"]
    assert target.read_text(encoding="utf-8") == "before"


@pytest.mark.parametrize("name", ["scene.txt", "scene", ".xml"])
def test_other_names_are_refused(name, tmp_path):
    with pytest.raises(InputError, match=r"ends in \.xml"):
        export_scene(diffuse(), tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_the_notes_say_how_lengths_have_changed(tmp_path):
    notes = export_scene(scene(floor(5e-3), lights=(lamp(),)), tmp_path / "scene.xml")
    assert any("lengths" in note for note in notes)


def test_render_refuses_what_is_not_there(tmp_path):
    done = module("render", str(tmp_path / "none.xml"), "-o", "image.exr")
    assert done.returncode == 2
    assert "none.xml" in done.stderr


def test_the_report_for_doctor_says_what_runs():
    ready, lines = backend_report()
    assert ready
    assert any(backend().variant in line and "Mitsuba" in line for line in lines)
