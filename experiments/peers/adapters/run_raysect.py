"""Raysect, direct light alone, three spectral bins for red, green and blue, over pixels' areas.

Its pinhole camera weighs every ray by the cosine of its angle to the axis, which is divided out; its x runs leftwards.
Its emitters shine to both sides: an absorbing plate stands a little behind each.
"""

from __future__ import annotations

from importlib.metadata import version

import numpy as np
from plain import RENDERING, Floats, Plain, normal_area, outline, run  # type: ignore[import-not-found]

BEHIND = 1e-4
"""How far behind an emitter its plate stands, in the scene's unit."""
LAMP_FACES = np.array([[0, 1, 2], [0, 2, 3]])


def spectrum(colour: Floats):  # type: ignore[no-untyped-def]
    """Three flat parts from 400 to 700 nm, whose means are the colour."""
    from raysect.optical import InterpolatedSF  # type: ignore[import-not-found]

    r, g, b = (float(value) for value in colour)
    edge = 1e-6
    places = [390, 500 - edge, 500 + edge, 600 - edge, 600 + edge, 710]
    return InterpolatedSF(places, [r, r, g, g, b, b])


def world_of(scene: Plain, one_sided: bool):  # type: ignore[no-untyped-def]
    """Raysect's own scene."""
    from raysect.core import translate  # type: ignore[import-not-found]
    from raysect.optical import World
    from raysect.optical.material import (  # type: ignore[import-not-found]
        AbsorbingSurface,
        Lambert,
        UniformSurfaceEmitter,
    )
    from raysect.primitive import Mesh, Sphere  # type: ignore[import-not-found]

    world = World()

    def mesh(vertices: Floats, faces: Floats, material: object) -> None:
        Mesh(vertices, faces, smoothing=False, closed=False, parent=world, material=material)

    for corners, albedo in scene.meshes():
        mesh(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3), Lambert(spectrum(albedo)))
    for ball, albedo in scene.balls():
        Sphere(ball[3], parent=world, transform=translate(*ball[:3]), material=Lambert(spectrum(albedo)))
    for light, radiance in scene.lamps():
        mesh(outline(light), LAMP_FACES, UniformSurfaceEmitter(spectrum(radiance)))
        if one_sided:
            mesh(outline(light) - BEHIND * normal_area(light)[0], LAMP_FACES, AbsorbingSurface())
    return world


def render(
    scene: Plain,
    samples: int = 16,
    seed: int = 0,
    threads: int = 1,
    one_sided: bool = True,
    cosine_undone: bool = True,
    path_weight: float = 0.99,
    vertical: bool = False,
    depth: int = 2,
) -> tuple[Floats, str]:
    """Image and version. It has one thread, whatever is asked: of several, seeds do not repeat."""
    from raysect.core import AffineMatrix3D
    from raysect.core.math.random import seed as set_seed  # type: ignore[import-not-found]
    from raysect.core.workflow import SerialEngine  # type: ignore[import-not-found]
    from raysect.optical.observer import PinholeCamera, SpectralRadiancePipeline2D  # type: ignore[import-not-found]

    pipeline = SpectralRadiancePipeline2D()
    axes = np.column_stack([-scene.right, scene.up, scene.look, scene.position])
    camera = PinholeCamera(
        (scene.width, scene.height),
        fov=float(scene.fov) if vertical else scene.longer_fov,
        parent=world_of(scene, one_sided),
        transform=AffineMatrix3D(np.vstack([axes, [0, 0, 0, 1]]).tolist()),
        pipelines=[pipeline],
    )
    camera.pixel_samples, camera.spectral_bins, camera.spectral_rays = samples, 3, 1
    camera.min_wavelength, camera.max_wavelength = 400, 700
    camera.ray_extinction_min_depth, camera.ray_extinction_prob, camera.ray_max_depth = 1, 0.0, depth
    camera.ray_important_path_weight = path_weight
    camera.quiet, camera.render_engine = True, SerialEngine()
    set_seed(seed + 1)
    with RENDERING:
        camera.observe()
    image = np.asarray(pipeline.frame.mean).transpose(1, 0, 2)
    if cosine_undone:
        y, x = np.mgrid[0 : scene.height, 0 : scene.width] + 0.5
        u = scene.half_height * scene.width / scene.height * (2 * x / scene.width - 1)
        v = scene.half_height * (1 - 2 * y / scene.height)
        image = image * np.sqrt(1 + u**2 + v**2)[..., None]
    return image, f"raysect {version('raysect')}"


if __name__ == "__main__":
    run(render, scale=0.25)
