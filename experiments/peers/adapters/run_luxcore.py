"""LuxCore, direct light alone, over pixels' areas.

Its images lie one row low: the screen window is moved up by a row. Balls are meshes with smooth normals.
"""

from __future__ import annotations

import math
import os
import sys
import time
from typing import Any

import numpy as np
from plain import RENDERING, Floats, Plain, ball_mesh, outline, run  # type: ignore[import-not-found]

LEVELS = 6
Properties = dict[str, list[Any]]
"""LuxCore's names and their values."""
LAMP_FACES = np.array([[0, 1, 2], [0, 2, 3]])


def scene_properties(scene: Plain, rows: float, vertical: bool) -> Properties:
    """LuxCore's own names. ``rows`` by which the window is moved; ``vertical``: the field of view taken as it is."""
    target, near = scene.position + scene.look, min(scene.width, scene.height)
    across, down = scene.width / near, scene.height / near
    shift = 2 * down / scene.height * rows
    # Without a window the field of view is that of the longer side; with one, of what lies from -1 to 1.
    short = math.degrees(2 * math.atan(scene.half_height * min(scene.width / scene.height, 1.0)))
    window = {} if vertical else {"screenwindow": [-across, across, -down - shift, down - shift]}
    camera = {
        "type": ["perspective"],
        "lookat.orig": scene.position.tolist(),
        "lookat.target": target.tolist(),
        "up": scene.up.tolist(),
        "fieldofview": [float(scene.fov) if vertical else short],
        "autofocus.enable": [False],
        "lensradius": [0.0],
        "clippinghither": [1e-3],
        "clippingyon": [1e6],
        **window,
    }
    found = {f"scene.camera.{name}": value for name, value in camera.items()}

    def body(name: str, vertices: Floats, faces: Floats, albedo: Floats, **more: list[Any]) -> None:
        found.update(
            {
                f"scene.materials.{name}.type": ["matte"],
                f"scene.materials.{name}.kd": [float(value) for value in albedo],
                f"scene.shapes.{name}.type": ["inlinedmesh"],
                f"scene.shapes.{name}.vertices": [float(value) for value in np.ravel(vertices)],
                f"scene.shapes.{name}.faces": [int(value) for value in np.ravel(faces)],
                f"scene.objects.{name}.shape": [name],
                f"scene.objects.{name}.material": [name],
            }
        )
        found.update({f"scene.{key.replace('__', f'.{name}.')}": value for key, value in more.items()})

    for k, (corners, albedo) in enumerate(scene.meshes()):
        body(f"mesh{k}", corners, np.arange(3 * len(corners)), albedo)
    vertices, faces = ball_mesh(LEVELS)
    for k, (ball, albedo) in enumerate(scene.balls()):
        body(f"ball{k}", ball[:3] + ball[3] * vertices, faces, albedo, shapes__normals=vertices.ravel().tolist())
    for k, (light, radiance) in enumerate(scene.lamps()):
        body(f"light{k}", outline(light), LAMP_FACES, np.zeros(3))
        found[f"scene.materials.light{k}.emission"] = radiance.tolist()
        found[f"scene.materials.light{k}.emission.power"] = [0.0]
        found[f"scene.materials.light{k}.emission.efficency"] = [0.0]
    return found


def film_properties(
    scene: Plain, samples: int, seed: int, threads: int, depth: int | None, filter: str | None
) -> Properties:
    """How it is rendered; None leaves a default."""
    found: Properties = {
        "renderengine.type": ["PATHCPU"],
        "renderengine.seed": [seed + 1],
        "film.width": [scene.width],
        "film.height": [scene.height],
        "sampler.type": ["SOBOL"],
        "native.threads.count": [threads],
        "batch.haltspp": [samples],
        "film.outputs.0.type": ["RGB"],
        "film.outputs.0.filename": ["unused.exr"],
    }
    if depth is not None:
        found |= {f"path.pathdepth.{kind}": [depth] for kind in ("total", "diffuse", "glossy", "specular")}
    if filter is not None:
        found["film.filter.type"] = [filter]
    return found


def render(
    scene: Plain,
    samples: int = 64,
    seed: int = 0,
    threads: int = 2,
    rows: float = 1.0,
    depth: int | None = 1,
    filter: str | None = "NONE",
    output: str = "RGB",
    vertical: bool = False,
) -> tuple[Floats, str]:
    """Image and version."""
    import pyluxcore  # type: ignore[import-not-found]

    def properties(values: Properties):  # type: ignore[no-untyped-def]
        found = pyluxcore.Properties()
        for name, value in values.items():
            found.Set(pyluxcore.Property(name, value))
        return found

    pyluxcore.Init()
    pyluxcore.SetLogHandler(lambda line: None)
    made = pyluxcore.Scene()
    made.Parse(properties(scene_properties(scene, rows, vertical)))
    film = properties(film_properties(scene, samples, seed, threads, depth, filter) | {"film.outputs.0.type": [output]})
    session = pyluxcore.RenderSession(pyluxcore.RenderConfig(film, made))
    with RENDERING:
        session.Start()
        while not session.HasDone():
            time.sleep(0.005)
            session.UpdateStats()
        session.Stop()
    image = np.zeros((scene.height, scene.width, 3), dtype=np.float32)
    session.GetFilm().GetOutputFloat(getattr(pyluxcore.FilmOutputType, output), image)
    return image[::-1], f"LuxCore {pyluxcore.Version()}"


if __name__ == "__main__":
    run(render, scale=8.0)
    sys.stdout.flush()
    os._exit(0)  # a thread of its log aborts the interpreter's usual end
