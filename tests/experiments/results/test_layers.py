"""One EXR file holds all that is known of an image's pixels, and says it in names that viewers know."""

from __future__ import annotations

import math

import numpy as np
import OpenEXR
import pytest
from builders import CAMERA, floor, lamp, scene
from click.testing import CliRunner

from nusselt.experiments.check.draw import Drawing, draw
from nusselt.experiments.check.layers import LIGHTS, drawn_layers
from nusselt.experiments.cli.main import main
from nusselt.experiments.front.render import render
from nusselt.experiments.images.read import read_image
from nusselt.experiments.results.layers import image_layers, scene_layers, write_layers
from nusselt.experiments.results.pictures import write_pictures
from nusselt.renderer.estimators import Area
from nusselt.renderer.image import Image
from nusselt.renderer.image import render as render_image
from nusselt.renderer.surfaces import Material

W, H = 24, 18
ALBEDO = (0.2, 0.4, 0.6)
ROOM = scene(floor(material=Material(ALBEDO)), lights=(lamp(), lamp(3.0, 0.3, (1.0, 2.0, 3.0))), size=(W, H))


def channels(path) -> dict[str, np.ndarray]:
    with OpenEXR.File(str(path), separate_channels=True) as file:
        assert len(file.parts) == 1
        return {name: channel.pixels for name, channel in file.channels().items()}


@pytest.mark.parametrize("estimator", ["exact", "area"])
def test_the_lights_shares_sum_to_the_image(estimator):
    drawing = Drawing(estimator=estimator, samples=4)
    image = draw(ROOM, drawing).image
    layers = drawn_layers(ROOM, image, drawing)
    np.testing.assert_allclose(layers["light1"] + layers["light2"], image.mean, rtol=1e-12, atol=1e-15)
    assert layers["light1"].any()
    assert not np.array_equal(layers["light1"], image.mean)


@pytest.mark.parametrize("lights", [1, LIGHTS + 1])
def test_one_light_is_the_image_and_very_many_have_no_layers(lights):
    room = scene(floor(), lights=tuple(lamp(2.0 + k) for k in range(lights)), size=(4, 3))
    drawing = Drawing(estimator="exact")
    assert not [name for name in drawn_layers(room, draw(room, drawing).image, drawing) if name.startswith("light")]


def test_depth_position_normal_and_albedo_are_those_of_what_is_seen():
    """Of a floor y = 0, from a camera at (0, 3, 6) that looks at the origin."""
    layers = scene_layers(ROOM)
    on = layers["albedo"][0] > 0
    assert 50 < on.sum() < W * H
    position = np.array(CAMERA.position)
    view = -position / np.linalg.norm(position)
    np.testing.assert_allclose(layers["position"][1, on], 0, atol=1e-12)
    away = layers["position"][:, on] - position[:, None]
    np.testing.assert_allclose(layers["depth"][0, on], view @ away, rtol=1e-6)
    np.testing.assert_allclose(layers["normal"][:, on], np.tile([[0], [1], [0]], on.sum()), atol=1e-12)
    np.testing.assert_allclose(layers["albedo"][:, on], np.tile(np.array(ALBEDO)[:, None], on.sum()), rtol=1e-7)
    nothing = np.isinf(layers["depth"][0])
    assert nothing.any()
    assert not layers["normal"][:, nothing].any()
    assert not layers["position"][:, nothing].any()


def test_a_scene_far_from_the_origin_has_its_own_positions():
    far = (4096.0, 0.0, 0.0)
    moved = ROOM.with_(
        meshes=tuple(type(m)(m.vertices + np.array(far)[:, None], m.triangles, m.material) for m in ROOM.meshes),
        lights=(lamp().moved(-np.array(far)),),
        camera=type(CAMERA)(
            *(tuple(np.add(v, far)) for v in (CAMERA.position, CAMERA.target)), CAMERA.up, CAMERA.fov_y
        ),
    )
    here, there = scene_layers(ROOM), scene_layers(moved)
    on = here["albedo"][0] > 0
    np.testing.assert_allclose(there["position"][:, on] - np.array(far)[:, None], here["position"][:, on], atol=1e-3)


def test_blocks_of_rows_are_the_image(monkeypatch):
    whole = scene_layers(ROOM)
    monkeypatch.setattr("nusselt.experiments.results.layers.BLOCK", 5 * W)
    for name, values in scene_layers(ROOM).items():
        np.testing.assert_array_equal(values, whole[name])


def test_noise_is_there_where_it_was_measured():
    noisy = render_image(ROOM, Area(samples=4), passes=4)
    np.testing.assert_allclose(image_layers(noisy)["standardError"], np.sqrt(noisy.variance / 4))
    assert "standardError" not in image_layers(render_image(ROOM, Area(samples=4)))
    assert "bound" in image_layers(render(ROOM, estimator="exact").image)


def test_the_file_shows_the_image_first_and_is_read_as_it(tmp_path):
    picture = render(ROOM, estimator="exact")
    picture.write(tmp_path / "a.exr", aovs=True)
    found = channels(tmp_path / "a.exr")
    layers = {"albedo.R", "normal.X", "depth.Z", "position.Z", "light1.G", "light2.B", "emitter.Y", "bound.Y"}
    assert {"R", "G", "B", *layers} <= found.keys()
    raw = read_image(tmp_path / "a.exr", ROOM)
    np.testing.assert_array_equal(raw.values, picture.image.mean.astype(np.float32))
    assert "what else it holds is left out: albedo, background, bound, depth" in raw.notes[0]
    light = read_image(f"{tmp_path / 'a.exr'}:light2", ROOM).values
    np.testing.assert_array_equal(light[0], found["light2.R"])


def test_a_row_without_a_reference_has_its_layers_too(tmp_path):
    image = Image.without_noise(np.ones((3, H, W)), np.zeros((H, W)), np.zeros((H, W)))
    where = write_pictures({}, image, None, tmp_path / "row", ROOM)
    assert where["layers_exr"] == "row.exr"
    assert {"R", "depth.Z"} <= channels(tmp_path / "row.exr").keys()


def test_the_command_writes_layers_and_refuses_formats_without(tmp_path):
    told = CliRunner().invoke(main, ["render", "quad", "--aovs", "-o", str(tmp_path / "a.png")])
    assert told.exit_code == 2
    assert "a name that ends in .exr: other formats have no layers" in told.stderr
    told = CliRunner().invoke(main, ["render", "quad", "--bits", "16", "-o", str(tmp_path / "a.exr")])
    assert told.exit_code == 2
    assert "bits = 16" in told.stderr
    assert not list(tmp_path.iterdir())


def test_infinite_depth_stays_infinite(tmp_path):
    write_layers(tmp_path / "a.exr", {"": np.ones((3, 2, 2)), "depth": np.full((1, 2, 2), math.inf)})
    assert np.isinf(channels(tmp_path / "a.exr")["depth.Z"]).all()
