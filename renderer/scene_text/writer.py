"""The scene text format, written: what the reader turns back into an equal scene."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from nusselt.renderer.expected_pixel import ExpectedPixel
from nusselt.renderer.lights import Light
from nusselt.renderer.lights.text import numbers, surface_of
from nusselt.renderer.lobes import Lobe
from nusselt.renderer.lobes.protocol import from_values, values_of
from nusselt.renderer.scene import Scene
from nusselt.renderer.sensor import Sensor
from nusselt.renderer.surfaces import Ellipsoid, Material, Mesh
from nusselt.renderer.validation import Vec3

from .state import check_output


def write_scene(scene: Scene) -> str:
    """Say a scene in the text format.

    Parameters
    ----------
    scene : Scene
        Any scene; its ``output`` must be a bare file name.

    Returns
    -------
    str
        Text whose parse equals ``scene``, given the same name, with every number in its shortest exact form.

    Raises
    ------
    InputError
        If ``output`` or a texture cannot be said in the format.

    Notes
    -----
    Not in the format: ``two_sided`` (a comment tells of it), the name and the warnings. Vertices that no
    triangle uses and meshes without triangles are left out. A mesh's material is always restated, so that
    neighbours of one material stay two meshes. Spheres (as ``Ellipsoid.sphere`` makes them) and ellipsoids
    along the world's axes come back exactly; any other comes back as the same surface to rounding, but with
    other axes: the image of the unit sphere under R1 diag R2 does not depend on the rotation R2, so only
    R1 diag is written.
    """
    scene.refuse_textures("the format")
    kinds = tuple(dict.fromkeys(type(lobe) for material in scene.materials for lobe in material.lobes))
    vertices = itertools.count()
    groups = (
        _settings(scene),
        (line for light in scene.lights for line in _light(light, vertices)),
        _sensors(scene.sensors),
        _pixels(scene.pixels),
        _meshes(scene.meshes, kinds, vertices),
        _ellipsoids(scene.ellipsoids, kinds),
    )
    return "\n".join("".join(f"{line}\n" for line in group) for group in groups)


def _numbers(*values: float) -> str:
    return " ".join(repr(float(value)) for value in values)


def _settings(scene: Scene) -> Iterator[str]:
    camera = scene.camera
    yield f"size {scene.width} {scene.height}"
    yield f"output {check_output(scene.output)}"
    yield f"camera {_numbers(*camera.position, *camera.target, *camera.up, camera.fov_y)}"
    yield f"integrator {scene.integrator}"
    yield f"lightsamples {scene.light_samples}"
    yield f"lightstratify {'on' if scene.stratify else 'off'}"
    yield f"spp {scene.spp}"
    if scene.two_sided:
        yield "# This scene's surfaces are two-sided, which the format cannot say."


def _light(light: Light, vertices: Iterator[int]) -> Iterator[str]:
    yield f"{light.TEXT.command} {_numbers(*numbers(light))}"
    if light.TEXT.of_surface:
        yield from _triangles(surface_of(light), vertices)
        yield f"{light.TEXT.command} 0 0 0"


def _sensors(sensors: Iterable[Sensor]) -> Iterator[str]:
    for sensor in sensors:
        yield f"sensor {_numbers(*sensor.position, *sensor.normal)}"
        if sensor.expected is not None:
            yield f"expect {_numbers(*sensor.expected, sensor.percent)}"


def _pixels(pixels: Iterable[ExpectedPixel]) -> Iterator[str]:
    for pixel in pixels:
        yield f"expectPixel {pixel.x} {pixel.y} {_numbers(*pixel.radiance, pixel.percent)}"


def _material(material: Material, kinds: Sequence[type[Lobe]]) -> Iterator[str]:
    """Every parameter of every kind of lobe that the scene has: what is not said again would stay as it was."""
    there = {type(lobe): lobe for lobe in material.lobes}
    for kind in kinds:
        for name, value in values_of(there.get(kind) or from_values(kind, {})).items():
            yield f"{name} {_numbers(*(value if isinstance(value, tuple) else (value,)))}"
    yield f"emission {_numbers(*material.emission)}"


def _meshes(meshes: Iterable[Mesh], kinds: Sequence[type[Lobe]], vertices: Iterator[int]) -> Iterator[str]:
    for mesh in meshes:
        if mesh.triangles.size:
            yield from _material(mesh.material, kinds)
            yield from _triangles(mesh, vertices)


def _triangles(mesh: Mesh, vertices: Iterator[int]) -> Iterator[str]:
    """A mesh's vertices, their numbers taken from those that are left, and triangles."""
    used, triangles = np.unique(mesh.triangles, return_inverse=True)
    number = np.fromiter(itertools.islice(vertices, used.size), dtype=np.int64, count=used.size)
    for x, y, z in mesh.vertices[:, used].T.tolist():
        yield f"vertex {x!r} {y!r} {z!r}"
    for i, j, k in number[triangles.reshape(3, -1)].T.tolist():
        yield f"tri {i} {j} {k}"


def _ellipsoids(ellipsoids: Iterable[Ellipsoid], kinds: Sequence[type[Lobe]]) -> Iterator[str]:
    material = None
    for ellipsoid in ellipsoids:
        if ellipsoid.material != material:
            material = ellipsoid.material
            yield from _material(material, kinds)
        yield from _ellipsoid(ellipsoid)


def _ellipsoid(ellipsoid: Ellipsoid) -> Iterator[str]:
    """A ``sphere`` line where that is enough, else the unit sphere under translate, rotate and scale."""
    if (radius := ellipsoid.radius) is not None:
        yield f"sphere {_numbers(*ellipsoid.center, radius)}"
        return
    axes = np.array(ellipsoid.axes)
    lengths = axes.diagonal()
    turn: tuple[Vec3, float] | None = None
    if (axes != np.diag(lengths)).any():
        # A power of two keeps the decomposition exact and its products away from overflow.
        size = 2.0 ** math.frexp(np.abs(axes).max())[1]
        rotation, lengths, _ = np.linalg.svd(axes / size)
        lengths = lengths * size
        rotation[:, 2] *= np.sign(np.linalg.det(rotation))  # mirrored, the ellipsoid is the same
        turn = _axis_angle(rotation)
    yield "pushTransform"
    yield f"translate {_numbers(*ellipsoid.center)}"
    if turn:
        yield f"rotate {_numbers(*turn[0], turn[1])}"
    yield f"scale {_numbers(*lengths)}"
    yield "sphere 0 0 0 1"
    yield "popTransform"


def _axis_angle(rotation: np.ndarray) -> tuple[Vec3, float]:
    """Axis and angle in degrees of a rotation matrix, through its quaternion.

    Of the quaternion's four components the largest is found first and the others by division by it: no
    cancellation near 180 degrees (Shepperd 1978).
    """
    r = rotation
    trace = r[0, 0] + r[1, 1] + r[2, 2]
    squares = [trace, r[0, 0], r[1, 1], r[2, 2]]
    largest = int(np.argmax(squares))
    if largest == 0:
        q = [1 + trace, r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]]
    else:
        i = largest - 1
        j, k = (i + 1) % 3, (i + 2) % 3
        q = [r[k, j] - r[j, k], 0.0, 0.0, 0.0]
        q[1 + i] = 1 + r[i, i] - r[j, j] - r[k, k]
        q[1 + j] = r[j, i] + r[i, j]
        q[1 + k] = r[k, i] + r[i, k]
    w, x, y, z = (float(c) for c in q)
    length = math.hypot(x, y, z)
    if length == 0:
        return (1.0, 0.0, 0.0), 0.0
    return (x, y, z), math.degrees(2 * math.atan2(length, w))
