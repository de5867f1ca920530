"""One EXR file holds all that is known of an image's pixels, and says it in names that viewers know."""

from __future__ import annotations

import math

import numpy as np
import OpenEXR
import pytest
from builders import CAMERA, floor, lamp, scene
from click.testing import CliRunner

from nusselt.experiments.check.draw import Drawing, draw
from nusselt.experiments.check.layers import drawn_layers
from nusselt.experiments.check.request import Reading
from nusselt.experiments.cli.main import main
from nusselt.experiments.front.render import render
from nusselt.experiments.images.read import read_image
from nusselt.experiments.results.layers import image_layers, scene_layers, write_layers
from nusselt.experiments.results.pictures import write_pictures
from nusselt.experiments.results.visibility import visibility_layers
from nusselt.experiments.verdict.pooling import combine_images
from nusselt.renderer.estimators import Area
from nusselt.renderer.image import Image
from nusselt.renderer.image import render as render_image
from nusselt.renderer.lights import QuadLight
from nusselt.renderer.surfaces import Material
from nusselt.renderer.tile import LIGHTS

W, H = 24, 18
ALBEDO = (0.2, 0.4, 0.6)
ROOM = scene(floor(material=Material(ALBEDO)), lights=(lamp(), lamp(3.0, 0.3, (1.0, 2.0, 3.0))), size=(W, H))


def channels(path) -> dict[str, np.ndarray]:
    with OpenEXR.File(str(path), separate_channels=True) as file:
        assert len(file.parts) == 1
        return {name: channel.pixels for name, channel in file.channels().items()}


GLOWING = floor(0.4, 0.5, Material(ALBEDO, emission=(0.5, 0.0, 0.25)))
"""A plate over the floor, in the way of both lights; it shines, and lights nothing."""
PLATED = ROOM.with_(meshes=(*ROOM.meshes, GLOWING))


def sum_of_parts(layers) -> np.ndarray:
    return sum(values for name, values in layers.items() if name.startswith(("light", "emission")))


@pytest.mark.parametrize(
    "drawing",
    [
        Drawing(estimator="exact"),
        Drawing(estimator="area", samples=4),
        Drawing(estimator="common-points", error=0.2),
        Drawing(estimator="exact", pixel_rule="area", tolerance=0.01),
        Drawing(estimator="area", samples=1, pixel_rule="area"),
    ],
    ids=["exact", "area", "passes", "by area", "boxes"],
)
@pytest.mark.parametrize("room", [ROOM, PLATED], ids=["room", "glowing"])
def test_the_lights_shares_and_what_glows_sum_to_the_image(drawing, room):
    read = Reading().scene(room, drawing.pixel_rule)
    image = draw(read, drawing).image
    layers, left_out = drawn_layers(read, image, drawing)
    most = (drawing.tolerance or 1e-6) * image.mean.max()  # where a tolerance is asked for each light is drawn to it
    np.testing.assert_allclose(sum_of_parts(layers), image.mean, rtol=2e-6, atol=most)
    assert ("emission" in layers) == (room is PLATED)
    assert all(layers[name].any() for name in ("light1", "light2"))
    assert not any("light by light" in what for what in left_out)


def test_a_lights_share_is_the_image_without_the_others():
    drawing = Drawing(estimator="exact")
    layers, _ = drawn_layers(PLATED, draw(PLATED, drawing).image, drawing)
    dark = PLATED.with_(lights=tuple(light.with_colour((0.0, 0.0, 0.0)) for light in PLATED.lights))
    np.testing.assert_allclose(layers["emission"], draw(dark, drawing).image.mean, rtol=1e-6)
    for k, light in enumerate(PLATED.lights):
        alone = PLATED.with_(lights=(*dark.lights[:k], light, *dark.lights[k + 1 :]))
        expected = draw(alone, drawing).image.mean - layers["emission"]
        np.testing.assert_allclose(layers[f"light{k + 1}"], expected, rtol=1e-6, atol=1e-6)


def test_shares_of_pooled_images_are_pooled():
    parts = [render_image(ROOM, Area(samples=1), seed=seed, passes=2 + seed, by_light=True) for seed in (0, 1)]
    pooled = combine_images(parts)
    np.testing.assert_allclose(pooled.light_means.sum(axis=0), pooled.mean, rtol=2e-6, atol=1e-6)


@pytest.mark.parametrize(("lights", "why"), [(1, "1 light"), (LIGHTS + 1, "25 lights")])
def test_one_light_is_the_image_and_very_many_have_no_layers(lights, why):
    room = scene(floor(), lights=tuple(lamp(2.0 + k) for k in range(lights)), size=(4, 3))
    drawing = Drawing(estimator="exact")
    layers, left_out = drawn_layers(room, draw(room, drawing).image, drawing)
    assert not [name for name in layers if name.startswith("light")]
    assert f"light by light: the scene has {why}" in left_out


def visible_by_hand(positions: np.ndarray, light: QuadLight, shields: list[tuple[float, float]]) -> np.ndarray:
    """Visible share of irradiance at points (3, n) of a floor, behind squares (half side, height) around the y axis."""
    u, v = ((np.indices((80, 80)) + 0.5) / 80).reshape(2, 1, -1)
    corner, ab, ac = (np.array(edge)[:, None, None] for edge in (light.corner, light.ab, light.ac))
    ways = corner + ab * u + ac * v - positions[..., None]
    weight = ways[1] ** 2 / (ways**2).sum(axis=0) ** 2
    is_open = np.ones(weight.shape, dtype=bool)
    for half, height in shields:
        where = positions[..., None] + ways * (height - positions[1][:, None]) / ways[1]
        is_open &= ~((np.abs(where[0]) < half) & (np.abs(where[2]) < half) & (positions[1][:, None] < height))
    return (weight * is_open).sum(axis=1) / weight.sum(axis=1)


@pytest.mark.parametrize(("is_exact", "most"), [(True, 0.01), (False, 0.15)])
def test_visibility_is_the_share_of_a_lights_irradiance_that_arrives(is_exact, most):
    """Of the lower light behind the plate, of the upper one behind both: a square's edge moves a sum of 80 x 80 points
    by less than 0.01, and one of 4 x 4 by less than 0.15."""
    found, left_out = visibility_layers(PLATED, is_exact)
    layers = scene_layers(PLATED)
    on = (layers["albedo"][0] > 0) & (np.abs(layers["position"][1]) < 1e-3)
    positions = layers["position"][:, on].astype(float)
    for name, light, shields in zip(found, PLATED.lights, ([(0.4, 0.5)], [(0.4, 0.5), (0.5, 2.0)]), strict=True):
        assert 0 <= found[name].min() <= found[name].max() <= 1
        expected = visible_by_hand(positions, light, shields)
        np.testing.assert_allclose(found[name][0, on], expected, rtol=0, atol=most)
        np.testing.assert_allclose(found[name][0, on][expected == 1], 1, rtol=0, atol=1e-9)
        assert (expected < 0.5).any()
        assert (expected == 1).any() == (name == "visibility1")  # the lower light's back is in the upper one's way
        assert not found[name][0, layers["albedo"][0] == 0].any()
    assert left_out == ()


def test_lights_that_nothing_blocks_have_no_visibility():
    found, left_out = visibility_layers(ROOM, is_exact=True)
    assert found.keys() == {"visibility2"}
    assert left_out == ("visibility of light 1: nothing stands in its way, or it lights nothing",)


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
    """And holds, read by OpenEXR, what was computed; what it does not hold its header says."""
    picture = render(PLATED, estimator="exact")
    picture.write(tmp_path / "a.exr", aovs=True)
    found = channels(tmp_path / "a.exr")
    layers = {"albedo.R", "normal.X", "depth.Z", "position.Z", "emitter.Y", "bound.Y", "visibility1.Y", "visibility2.Y"}
    assert {"R", "G", "B", *layers} <= found.keys()
    for k, end in enumerate("RGB"):
        parts = sum(found[f"{name}.{end}"] for name in ("light1", "light2", "emission"))
        np.testing.assert_allclose(parts, picture.image.mean[k], rtol=2e-6, atol=1e-6)
    np.testing.assert_array_equal(
        found["visibility1.Y"], visibility_layers(PLATED, True)[0]["visibility1"][0].astype("f4")
    )
    raw = read_image(tmp_path / "a.exr", PLATED)
    np.testing.assert_array_equal(raw.values, picture.image.mean.astype(np.float32))
    assert "what else it holds is left out: albedo, background, bound, depth" in raw.notes[0]
    light = read_image(f"{tmp_path / 'a.exr'}:light2", PLATED).values
    np.testing.assert_array_equal(light[0], found["light2.R"])
    with OpenEXR.File(str(tmp_path / "a.exr")) as file:
        assert file.header()["comments"] == "left out: standard error: one pass, or nothing is random"


def test_a_rows_file_has_all_layers(tmp_path):
    """Its lights' shares are those of its own passes, its noise beside them."""
    image = render_image(PLATED, Area(samples=4), passes=3, by_light=True)
    assert write_pictures({}, image, None, tmp_path / "row", PLATED)["layers_exr"] == "row.exr"
    found = channels(tmp_path / "row.exr")
    assert {"standardError.R", "visibility1.Y", "visibility2.Y", "depth.Z", "normal.X", "albedo.R"} <= found.keys()
    parts = found["light1.G"] + found["light2.G"] + found["emission.G"]
    np.testing.assert_allclose(parts, found["G"], rtol=2e-6, atol=1e-6)
    np.testing.assert_array_equal(found["G"], image.mean[1].astype("f4"))
    assert 0 <= found["visibility2.Y"].min() < found["visibility2.Y"].max() == 1


def test_a_row_without_a_reference_has_its_layers_too(tmp_path):
    image = Image.without_noise(np.ones((3, H, W)), np.zeros((H, W)), np.zeros((H, W)))
    where = write_pictures({}, image, None, tmp_path / "row", ROOM)
    assert where["layers_exr"] == "row.exr"
    assert {"R", "depth.Z"} <= channels(tmp_path / "row.exr").keys()
    with OpenEXR.File(str(tmp_path / "row.exr")) as file:
        assert "light by light: their shares were not kept apart" in file.header()["comments"]


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
