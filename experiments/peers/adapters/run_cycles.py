"""Blender's Cycles, direct light alone; run by a Python with bpy, or by Blender itself.

A box filter a hundredth of a pixel wide makes pixels centres; one pixel wide, areas.
Balls are fine meshes with smooth normals. Rectangles are area lamps, which are exact; other parallelograms are meshes
that emit on their front. Their triangles are sampled by area in small units, and by solid angle in large ones, which
loses samples (see findings/cycles_mesh_emitters_dim.sh): the scene is left at one or two units.
"""

from __future__ import annotations

import math
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))  # Blender runs a script without its folder

from plain import RENDERING, Floats, Plain, ball_mesh, normal_area, outline, run  # type: ignore[import-not-found]

LEVELS = 7
BOUNCES = ("max_bounces", "diffuse_bounces", "glossy_bounces", "transmission_bounces", "volume_bounces")
DEFAULTS: dict[str, Any] = {
    "filter": "BOX",
    "width": 1.0,
    "adaptive": False,
    "denoise": False,
    "bounces": 0,
    "lamps": True,
    "one_sided": True,
    "seen": True,
    "sensor_fit": "VERTICAL",
    "threshold": 0.0,
    "world": 0.0,
}
"""What the adapter says of Cycles's settings; None leaves what Cycles does if it is not asked."""


def start(scene: Plain, samples: int, seed: int, threads: int, said: dict):  # type: ignore[no-untyped-def,type-arg]
    """An empty Blender scene with its camera and settings."""
    import bpy  # type: ignore[import-not-found]
    from mathutils import Matrix  # type: ignore[import-not-found]

    bpy.ops.wm.read_factory_settings(use_empty=True)
    made = bpy.context.scene
    made.render.engine, cycles = "CYCLES", made.cycles
    settings = {
        "device": "CPU",
        "samples": samples,
        "seed": seed,
        "pixel_filter_type": said["filter"],
        "filter_width": said["width"],
        "use_adaptive_sampling": said["adaptive"],
        "use_denoising": said["denoise"],
        "light_sampling_threshold": said["threshold"],
        **dict.fromkeys(BOUNCES, said["bounces"]),
    }
    for name, value in settings.items():
        if value is not None:
            setattr(cycles, name, value)
    made.render.resolution_x, made.render.resolution_y = scene.width, scene.height
    made.render.resolution_percentage, made.render.threads_mode, made.render.threads = 100, "FIXED", threads
    made.world = bpy.data.worlds.new("dark")
    made.world.use_nodes = True  # a new world shines: its background is grey
    if said["world"] is not None:
        made.world.node_tree.nodes["Background"].inputs["Strength"].default_value = said["world"]
    camera = bpy.data.cameras.new("camera")
    if said["sensor_fit"]:
        camera.sensor_fit, camera.angle_y = said["sensor_fit"], math.radians(float(scene.fov))
    else:
        camera.angle = math.radians(float(scene.fov))
    camera.clip_start, camera.clip_end = 1e-3, 1e5
    matrix = np.eye(4)
    matrix[:3] = np.column_stack([scene.right, scene.up, -scene.look, scene.position])
    made.camera = add(made, "camera", camera, Matrix(matrix.tolist()))
    return made


def add(made, name: str, data, matrix=None):  # type: ignore[no-untyped-def]
    """An object of a scene."""
    import bpy

    found = bpy.data.objects.new(name, data)
    if matrix is not None:
        found.matrix_world = matrix
    made.collection.objects.link(found)
    return found


def mesh(made, vertices: Floats, faces: Floats, material, smooth: bool = False) -> None:  # type: ignore[no-untyped-def]
    """A mesh of one material."""
    import bpy

    data = bpy.data.meshes.new("mesh")
    data.from_pydata(np.asarray(vertices).tolist(), [], np.asarray(faces).tolist())
    data.polygons.foreach_set("use_smooth", [smooth] * len(data.polygons))
    data.update()
    data.materials.append(material)
    add(made, "mesh", data)


def surface(albedo: Floats):  # type: ignore[no-untyped-def]
    """Lambert's."""
    import bpy

    found = bpy.data.materials.new("surface")
    found.use_nodes = True
    tree = found.node_tree
    tree.nodes.clear()
    lambert, output = tree.nodes.new("ShaderNodeBsdfDiffuse"), tree.nodes.new("ShaderNodeOutputMaterial")
    lambert.inputs["Color"].default_value = (*map(float, albedo), 1.0)
    tree.links.new(lambert.outputs[0], output.inputs["Surface"])
    return found


def glow(radiance: Floats, one_sided: bool):  # type: ignore[no-untyped-def]
    """What emits a radiance: strength times (1 - Backfacing)."""
    import bpy

    found = bpy.data.materials.new("glow")
    found.use_nodes = True
    tree, top = found.node_tree, float(np.max(radiance)) or 1.0
    tree.nodes.clear()
    emission, output = tree.nodes.new("ShaderNodeEmission"), tree.nodes.new("ShaderNodeOutputMaterial")
    emission.inputs["Color"].default_value = (*(float(value) / top for value in radiance), 1.0)
    emission.inputs["Strength"].default_value = top
    tree.links.new(emission.outputs[0], output.inputs["Surface"])
    if one_sided:
        back, share = tree.nodes.new("ShaderNodeNewGeometry"), tree.nodes.new("ShaderNodeMath")
        share.operation = "MULTIPLY_ADD"
        share.inputs[1].default_value, share.inputs[2].default_value = -top, top
        tree.links.new(back.outputs["Backfacing"], share.inputs[0])
        tree.links.new(share.outputs[0], emission.inputs["Strength"])
        found.cycles.emission_sampling = "FRONT"
    return found


def lamp(made, light: Floats, radiance: Floats, seen: bool | None) -> None:  # type: ignore[no-untyped-def]
    """An area lamp in a rectangle's place, with a black back; its power is pi A L."""
    import bpy
    from mathutils import Matrix

    normal, area = normal_area(light)
    top = float(np.max(radiance)) or 1.0
    data = bpy.data.lights.new("lamp", "AREA")
    data.shape, (data.size_y, data.size) = "RECTANGLE", np.linalg.norm(light[1:], axis=1).tolist()
    data.color, data.energy = (radiance / top).tolist(), math.pi * area * top
    x = light[2] / np.linalg.norm(light[2])
    matrix = np.eye(4)
    matrix[:3] = np.column_stack([x, np.cross(-normal, x), -normal, light.sum(axis=0) - (light[1] + light[2]) / 2])
    found = add(made, "lamp", data, Matrix(matrix.tolist()))
    if seen is not None:
        found.visible_camera = seen


def is_rectangle(light: Floats) -> bool:
    """Whether its edges are at right angles, in single precision."""
    ab, ac = light[1:]
    return abs(float(ab @ ac)) <= 1e-7 * float(np.linalg.norm(ab) * np.linalg.norm(ac))


def pixels(made) -> Floats:  # type: ignore[no-untyped-def]
    """Render, and read the image: EXR of 32 bits, as linear numbers."""
    import bpy

    with tempfile.TemporaryDirectory() as folder:
        settings = made.render.image_settings
        settings.file_format, settings.color_mode, settings.color_depth = "OPEN_EXR", "RGB", "32"
        made.render.filepath = str(Path(folder, "image.exr"))
        with RENDERING:
            bpy.ops.render.render(write_still=True)
        image = bpy.data.images.load(made.render.filepath)
        image.colorspace_settings.name = "Non-Color"
        found = np.empty(len(image.pixels), np.float32)
        image.pixels.foreach_get(found)
    width, height = image.size
    return found.reshape(height, width, image.channels)[::-1, :, :3]


def render(scene: Plain, samples: int = 64, seed: int = 0, threads: int = 2, **options: Any) -> tuple[Floats, str]:
    """Image and version; options as in `DEFAULTS`."""
    import bpy

    said = DEFAULTS | options
    made = start(scene, samples, seed, threads, said)
    for corners, albedo in scene.meshes():
        mesh(made, corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3), surface(albedo))
    vertices, faces = ball_mesh(LEVELS)
    for ball, albedo in scene.balls():
        mesh(made, ball[:3] + ball[3] * vertices, faces, surface(albedo), smooth=True)
    for light, radiance in scene.lamps():
        if said["lamps"] and is_rectangle(light):
            lamp(made, light, radiance, said["seen"])
        else:
            mesh(made, outline(light), [[0, 1, 2, 3]], glow(radiance, said["one_sided"]))
    return pixels(made), f"Blender {bpy.app.version_string}, Cycles"


if __name__ == "__main__":
    run(render, scale=1.0)
