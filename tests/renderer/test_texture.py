"""Textures: texels looked up where a ray hits, outside the integral; scenes without them do not know of them."""

from __future__ import annotations

import hashlib
from dataclasses import replace

import numpy as np
import pytest

from nusselt.experiments.check.question import with_pixel_rule
from nusselt.experiments.exchange.pbrt.write import pbrt_text
from nusselt.experiments.exchange.usd import usd_text
from nusselt.experiments.metamorphic.ask import Asking, ask
from nusselt.experiments.metamorphic.sources import EstimatorSource
from nusselt.experiments.peers.description import describe as for_peers
from nusselt.experiments.scenes.catalogue import load
from nusselt.mitsuba_bridge.description import describe
from nusselt.renderer.camera.rays import pixel_centres
from nusselt.renderer.camera.view import look
from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import Exact
from nusselt.renderer.image import render
from nusselt.renderer.pixels import render_area, render_centre
from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene_text import write_scene
from nusselt.renderer.surfaces import Ellipsoid, Material
from nusselt.renderer.texture import Painted, Texture

PICTURE = np.random.default_rng(1).uniform(0.05, 0.9, (3, 2, 3))


def textured(texture, scene=None, scale=1.0):
    """The classic scene's meshes with a texture, laid along x and z."""
    scene = scene or load("quad").with_(width=32, height=24)
    meshes = tuple(
        replace(mesh, material=Material(texture=texture), uv=scale * mesh.vertices[[0, 2]]) for mesh in scene.meshes
    )
    return scene.with_(meshes=meshes)


@pytest.mark.parametrize(
    ("wrap", "u", "column"), [("repeat", -0.1, 2), ("mirror", -0.1, 0), ("mirror", 1.4, 1), ("clamp", 7.0, 2)]
)
def test_outside_the_picture_it_repeats_mirrors_or_stays(wrap, u, column):
    for smooth in (False, True):
        texture = Texture(np.repeat(PICTURE, 9, axis=2) if smooth else PICTURE, smooth, wrap)
        assert np.allclose(texture(np.array([[u], [0.25]]))[:, 0], PICTURE[:, 0, column])


def test_between_texels_it_is_bilinear_and_moved_by_its_own_transform():
    texture = Texture(PICTURE, to_uv=((0.5, 0.0, 0.25), (0.0, -1.0, 1.0)))
    u, v = (1 / 3 - 0.25) / 0.5, 0.5  # at u = 1/3, v = 1/2 of the picture: amid four texels
    assert np.allclose(texture(np.array([[u], [v]]))[:, 0], PICTURE[:, :, :2].mean(axis=(1, 2)))


def test_the_light_that_arrives_is_that_of_a_white_surface_times_the_albedo():
    scene = textured(Texture(PICTURE), scale=0.3)
    white = scene.with_(meshes=tuple(replace(m, material=Material((1.0, 1.0, 1.0)), uv=None) for m in scene.meshes))
    near, geometry, _ = prepare(scene)
    view = look(near, geometry, *pixel_centres(range(scene.width), range(scene.height)))
    albedo = np.ones((3, scene.width * scene.height))
    albedo[:, view.lit] = view.points.diffuse
    first, second = render(scene, Exact()), render(white, Exact())
    assert np.ptp(view.points.diffuse) > 0.5
    assert first.routes == second.routes  # no dearer way for any pixel
    dark = first.emitter + first.background > 0
    expected = np.where(dark, second.mean, second.mean * albedo.reshape(second.mean.shape))
    assert np.allclose(first.mean, expected, rtol=1e-14, atol=0)


def test_scenes_without_textures_do_not_know_of_them(monkeypatch):
    """The same bits as where every texel has the surface's colour; their digest and work are as they always were."""
    scene = load("quad").with_(width=32, height=24)
    colour = scene.meshes[0].material.diffuse
    plain = render(textured(Texture(np.reshape(colour, (3, 1, 1))), scene), Exact()).mean

    def called(*_):
        raise AssertionError("a texture was looked up")

    monkeypatch.setattr(Painted, "albedo", called)
    assert np.array_equal(render(scene, Exact()).mean, plain)
    assert prepare(scene).geometry.painted == ()
    mesh = scene.meshes[0]
    told = hashlib.sha256(f"{mesh.vertices.shape},{mesh.triangles.shape},{mesh.material!r};".encode())
    told.update(mesh.vertices.tobytes() + mesh.triangles.tobytes())
    assert mesh.digest == told.hexdigest()
    assert "texture" not in repr(mesh.material)
    with pytest.raises(AssertionError, match="looked up"):
        render(textured(Texture(PICTURE)), Exact())


def test_a_texture_is_part_of_what_a_scene_is():
    scenes = [textured(t) for t in (Texture(PICTURE), Texture(PICTURE, False), Texture(PICTURE[:, ::-1]))]
    assert len({scene.digest() for scene in (*scenes, textured(Texture(PICTURE), scale=2.0))}) == 4
    assert scenes[0].materials[0].diffuse == tuple(PICTURE.max(axis=(1, 2)))


@pytest.mark.parametrize(
    "use",
    [
        write_scene,
        pbrt_text,
        usd_text,
        for_peers,
        lambda scene: describe(scene, None),
        lambda scene: ask([scene], EstimatorSource("exact"), Asking()),
        lambda scene: render_area(scene, Exact()),
        lambda scene: render_centre(scene, Exact()),
        lambda scene: scene.with_(spp=4),
        lambda scene: with_pixel_rule(scene, "area"),
        lambda scene: replace(scene.meshes[0], uv=None),
        lambda scene: replace(scene.meshes[0], material=Material()),
        lambda scene: Ellipsoid.sphere((0, 0, 0), 1, scene.meshes[0].material),
    ],
)
def test_where_it_would_be_lost_it_is_refused(use):
    with pytest.raises(InputError, match=r"texture|one colour"):
        use(textured(Texture(PICTURE)))
