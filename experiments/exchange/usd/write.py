"""A scene as USD text: geometry in the world, one prim a thing. Attributes that USD has in single precision are so."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from functools import singledispatch
from typing import NoReturn

import numpy as np

from nusselt.renderer.camera.rays import view_frame
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
    SunLight,
    TriangleLight,
)
from nusselt.renderer.scene import Scene
from nusselt.renderer.surfaces import Ellipsoid, Material, Mesh
from nusselt.renderer.validation import Vec3
from nusselt.renderer.vectors import Floats, column, frame, unit

Lines = Iterator[str]
FOCAL = 50.0
HEADER = """#usda 1.0
(
    defaultPrim = "World"
    metersPerUnit = 1
    renderSettingsPrimPath = "/Render/Settings"
    upAxis = "Y"
)
"""


def usd_text(scene: Scene) -> str:
    """Say a scene in USD.

    Raises
    ------
    InputError
        For what USD has no equal of: surfaces with a lobe besides Lambert's, spots, cosine lights.
    """
    scene.refuse_textures("what is written as USD")
    materials = list(dict.fromkeys(scene.materials))
    for material in materials:
        if material.is_glossy:
            raise InputError("surface", "glossy", "diffuse surfaces: USD's own have no Phong lobe")
    groups = [
        _camera(scene),
        *(_material(material, number) for number, material in enumerate(materials)),
        *(_mesh(mesh, k, materials.index(mesh.material), scene.two_sided) for k, mesh in enumerate(scene.meshes)),
        *(_ball(b, k, materials.index(b.material), scene.two_sided) for k, b in enumerate(scene.ellipsoids)),
        *(_light(light, f"Light{number}") for number, light in enumerate(scene.lights)),
    ]
    settings = [f"uniform int2 resolution = ({scene.width}, {scene.height})", "rel camera = </World/Camera>"]
    render = _prim("Scope", "Render", _prim("RenderSettings", "Settings", settings))
    world = _prim("Xform", "World", (line for group in groups for line in group))
    return HEADER + "".join(f"{line}\n" for part in (render, world) for line in part)


def _prim(kind: str, name: str, inside: Iterable[str], *apis: str) -> Lines:
    told = ", ".join(f'"{api}"' for api in apis)
    yield f'def {kind} "{name}"' + (f" (prepend apiSchemas = [{told}])" if apis else "")
    yield "{"
    for line in inside:
        yield f"    {line}"
    yield "}"


def _tuple(values: Iterable[float]) -> str:
    return "(" + ", ".join(repr(float(value)) for value in values) + ")"


def _placed(x: Floats, y: Floats, z: Floats, origin: Floats) -> Lines:
    """The transform with these columns; USD has them as rows."""
    rows = [(*np.ravel(v), w) for v, w in ((x, 0), (y, 0), (z, 0), (origin, 1))]
    yield f"matrix4d xformOp:transform = ({', '.join(map(_tuple, rows))})"
    yield 'uniform token[] xformOpOrder = ["xformOp:transform"]'


def _camera(scene: Scene) -> Lines:
    look, right, up = (unit(axis) for axis in view_frame(scene))
    high = 2 * FOCAL * math.tan(math.radians(scene.camera.fov_y) / 2)
    lens = [
        f"float focalLength = {FOCAL!r}",
        f"float horizontalAperture = {high * scene.width / scene.height!r}",
        f"float verticalAperture = {high!r}",
    ]
    return _prim("Camera", "Camera", [*lens, *_placed(right, up, -look, np.array(scene.camera.position))])


def _material(material: Material, number: int) -> Lines:
    shader = [
        'uniform token info:id = "UsdPreviewSurface"',
        f"color3f inputs:diffuseColor = {_tuple(material.diffuse)}",
        f"color3f inputs:emissiveColor = {_tuple(material.emission)}",
        "color3f inputs:specularColor = (0, 0, 0)",
        "float inputs:roughness = 1",
        "int inputs:useSpecularWorkflow = 1",
        "token outputs:surface",
    ]
    name = f"Material{number}"
    out = f"token outputs:surface.connect = </World/{name}/Preview.outputs:surface>"
    return _prim("Material", name, [out, *_prim("Shader", "Preview", shader)])


def _bound(number: int, both: bool) -> list[str]:
    return [f"uniform bool doubleSided = {int(both)}", f"rel material:binding = </World/Material{number}>"]


def _faces(mesh: Mesh) -> Lines:
    yield f"point3f[] points = [{', '.join(map(_tuple, mesh.vertices.T.tolist()))}]"
    yield f"int[] faceVertexCounts = {[3] * mesh.triangles.shape[1]}"
    yield f"int[] faceVertexIndices = {mesh.triangles.T.ravel().tolist()}"
    yield 'uniform token subdivisionScheme = "none"'


def _mesh(mesh: Mesh, number: int, material: int, both: bool) -> Lines:
    return _prim("Mesh", f"Mesh{number}", [*_faces(mesh), *_bound(material, both)], "MaterialBindingAPI")


def _ball(body: Ellipsoid, number: int, material: int, both: bool) -> Lines:
    x, y, z = np.array(body.axes).T
    inside = ["double radius = 1", *_placed(x, y, z, np.array(body.center)), *_bound(material, both)]
    return _prim("Sphere", f"Sphere{number}", inside, "MaterialBindingAPI")


def _shining(colour: Vec3, intensity: float = 1.0, normalize: bool = False) -> list[str]:
    return [
        f"color3f inputs:color = {_tuple(colour)}",
        f"float inputs:intensity = {intensity!r}",
        f"bool inputs:normalize = {int(normalize)}",
    ]


def _turned(axis: Vec3, origin: Vec3) -> Lines:
    """The z axis along one that is given."""
    x, y = frame(column(axis))
    return _placed(x, y, np.array(axis), np.array(origin))


def _refused(light: Light) -> NoReturn:
    raise InputError("light", f"a {light.kind}", "a kind that USD has: its cones and cosines are others")


@singledispatch
def _light(light: Light, name: str) -> Lines:
    """A light's prim."""
    _refused(light)


@_light.register
def _(light: QuadLight, name: str) -> Lines:
    p, ab, ac = (np.array(v) for v in (light.corner, light.ab, light.ac))
    place = _placed(ab, ac, -np.array(light.normal), p + ab / 2 + ac / 2)
    size = ["float inputs:width = 1", "float inputs:height = 1"]
    return _prim("RectLight", name, [*_shining(light.radiance), *size, *place])


@_light.register
def _(light: DiskLight, name: str) -> Lines:
    x, y, z = light.normal
    place = _turned((-x, -y, -z), light.center)
    return _prim("DiskLight", name, [*_shining(light.radiance), f"float inputs:radius = {light.radius!r}", *place])


@_light.register
def _(light: SphereLight, name: str) -> Lines:
    place = _turned((0.0, 0.0, 1.0), light.center)
    return _prim("SphereLight", name, [*_shining(light.radiance), f"float inputs:radius = {light.radius!r}", *place])


@_light.register
def _(light: PointLight, name: str) -> Lines:
    point = ["bool treatAsPoint = 1", *_turned((0.0, 0.0, 1.0), light.position)]
    return _prim("SphereLight", name, [*_shining(light.intensity, 4.0, True), *point])


@_light.register
def _(light: DirectionalLight, name: str) -> Lines:
    inside = [*_shining(light.irradiance), "float inputs:angle = 0", *_turned(light.direction, (0.0, 0.0, 0.0))]
    return _prim("DistantLight", name, inside)


@_light.register
def _(light: SunLight, name: str) -> Lines:
    place = _turned(light.direction, (0.0, 0.0, 0.0))
    inside = [*_shining(light.irradiance, normalize=True), f"float inputs:angle = {light.angle!r}", *place]
    return _prim("DistantLight", name, inside)


@_light.register
def _(light: SkyLight, name: str) -> Lines:
    return _prim("DomeLight", name, _shining(light.radiance))


@_light.register
def _(light: TriangleLight, name: str) -> Lines:
    corners = Mesh(np.array([light.a, light.b, light.c]).T, np.arange(3)[:, None])
    return _light(MeshLight(corners, light.radiance), name)


@_light.register
def _(light: MeshLight, name: str) -> Lines:
    mode = 'uniform token light:materialSyncMode = "noMaterialResponse"'
    return _prim("Mesh", name, [*_faces(light.surface), *_shining(light.radiance), mode], "MeshLightAPI")
