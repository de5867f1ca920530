"""A scene as pbrt-v4 text, every number in its shortest exact form; by pbrt's documentation, never run in it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import singledispatch

import numpy as np

from nusselt.renderer.errors import InputError
from nusselt.renderer.lights import (
    DirectionalLight,
    DiskLight,
    Light,
    MeshLight,
    PointLight,
    QuadLight,
    SkyLight,
    SphereLight,
    TriangleLight,
)
from nusselt.renderer.scene import Scene
from nusselt.renderer.surfaces import Ellipsoid, Material, Mesh
from nusselt.renderer.vectors import Floats, column, frame

Lines = Iterator[str]


def pbrt_text(scene: Scene) -> str:
    """Say a scene in pbrt's text.

    Raises
    ------
    InputError
        For what pbrt has no equal of, or what it has other than the scene: one-sided surfaces are two-sided there.
    """
    scene.refuse_textures("what is written for pbrt")
    for material in scene.materials:
        if material.is_glossy:
            raise InputError("surface", "glossy", "diffuse surfaces: pbrt has no Phong lobe")
        if max(material.emission) > 0:
            raise InputError("emission", material.emission, "surfaces that do not: in pbrt they would light")
        if max(material.diffuse) > 1:
            raise InputError("diffuse", material.diffuse, "at most 1, as pbrt has it")
    groups = [
        _head(scene),
        *(_light(light) for light in scene.lights),
        *(_mesh(mesh) for mesh in scene.meshes),
        *(_ball(body) for body in scene.ellipsoids),
    ]
    return "".join(f"{line}\n" for group in groups for line in group)


def _list(values: Iterable[float]) -> str:
    return "[" + " ".join(repr(float(value)) for value in values) + "]"


def _triangles(mesh: Mesh) -> str:
    indices = " ".join(map(str, mesh.triangles.T.ravel().tolist()))
    return f'Shape "trianglemesh" "point3 P" {_list(mesh.vertices.T.ravel())} "integer indices" [{indices}]'


def _head(scene: Scene) -> Lines:
    camera, (width, height) = scene.camera, (scene.width, scene.height)
    yield f'Film "rgb" "integer xresolution" {width} "integer yresolution" {height}'
    yield 'Integrator "path" "integer maxdepth" 1'
    yield "Scale -1 1 1 # a right-handed world"
    numbers = (*camera.position, *camera.target, *camera.up)
    yield "LookAt " + " ".join(repr(float(v)) for v in numbers)
    window = _list((-width / height, width / height, -1.0, 1.0))  # then fov is vertical
    yield f'Camera "perspective" "float fov" {camera.fov_y!r} "float screenwindow" {window}'
    yield "WorldBegin"


def _surface(material: Material) -> str:
    return f'Material "diffuse" "rgb reflectance" {_list(material.diffuse)}'


def _mesh(mesh: Mesh) -> Lines:
    if mesh.triangles.size:
        yield _surface(mesh.material)
        yield _triangles(mesh)


def _placed(matrix: Floats, origin: Floats) -> str:
    """Column by column."""
    full = np.eye(4)
    full[:3, :3], full[:3, 3] = matrix, origin
    return f"ConcatTransform {_list(full.T.ravel())}"


def _ball(body: Ellipsoid) -> Lines:
    yield "AttributeBegin"
    yield _surface(body.material)
    yield _placed(np.array(body.axes), np.array(body.center))
    yield 'Shape "sphere" "float radius" 1'
    yield "AttributeEnd"


def _area(light: Light, *inside: str) -> Lines:
    yield "AttributeBegin"
    yield f'AreaLightSource "diffuse" "rgb L" {_list(light.colour)}'
    yield from inside
    yield "AttributeEnd"


@singledispatch
def _light(light: Light) -> Lines:
    """A light's directives."""
    raise InputError("light", f"a {light.kind}", "a kind that pbrt has the same")


@_light.register
def _(light: QuadLight) -> Lines:
    p, ab, ac = (np.array(v) for v in (light.corner, light.ab, light.ac))
    patch = _list(np.concatenate((p, p + ac, p + ab, p + ab + ac)))  # its front is that of ac x ab
    return _area(light, f'Shape "bilinearmesh" "point3 P" {patch}')


@_light.register
def _(light: TriangleLight) -> Lines:
    return _area(light, _triangles(Mesh(np.array([light.a, light.b, light.c]).T, np.arange(3)[:, None])))


@_light.register
def _(light: MeshLight) -> Lines:
    return _area(light, _triangles(light.surface))


@_light.register
def _(light: DiskLight) -> Lines:
    normal = np.array(light.normal)
    x, y = (v[:, 0] for v in frame(column(normal)))
    disk = f'Shape "disk" "float radius" {light.radius!r}'
    return _area(light, _placed(np.stack((x, y, normal), axis=1), np.array(light.center)), disk)


@_light.register
def _(light: SphereLight) -> Lines:
    place = "Translate " + " ".join(map(repr, light.center))
    return _area(light, place, f'Shape "sphere" "float radius" {light.radius!r}')


@_light.register
def _(light: PointLight) -> Lines:
    yield f'LightSource "point" "rgb I" {_list(light.intensity)} "point3 from" {_list(light.position)}'


@_light.register
def _(light: DirectionalLight) -> Lines:
    ends = f'"point3 from" {_list(light.direction)} "point3 to" [0 0 0]'
    yield f'LightSource "distant" "rgb L" {_list(light.irradiance)} {ends}'


@_light.register
def _(light: SkyLight) -> Lines:
    yield f'LightSource "infinite" "rgb L" {_list(light.radiance)}'
