"""Radiance's rtrace, direct light alone, through pixel centres; no noise.

rtrace takes at most 64 points of a source, whatever -ds says, and its points are those of a source's middle in cells:
so the light is given as n x n sources of one point each. A triangle is sampled as the parallelogram about it, outside
too: sources are never triangles.
"""

from __future__ import annotations

import math
import os
import subprocess
import tempfile
from pathlib import Path

import numpy as np
from plain import RENDERING, Floats, Plain, outline, run, words  # type: ignore[import-not-found]

PLAIN = ("-h", "-fdf", "-ab", "0", "-av", "0", "0", "0", "-aa", "0", "-lr", "1")


def text(scene: Plain, cells: int, triangles: bool) -> str:
    """Radiance's own scene format."""
    lines = []
    for k, (corners, albedo) in enumerate(scene.meshes()):
        lines.append(f"void plastic m{k} 0 0 5 {words(albedo)} 0 0")
        lines += [f"m{k} polygon m{k}.{j} 0 0 9 {words(triangle)}" for j, triangle in enumerate(corners)]
    for k, (ball, albedo) in enumerate(scene.balls()):
        lines.append(f"void plastic s{k} 0 0 5 {words(albedo)} 0 0\ns{k} sphere s{k}.0 0 0 4 {words(ball)}")
    for k, (light, radiance) in enumerate(scene.lamps()):
        lines.append(f"void light l{k} 0 0 3 {words(radiance)}")
        for j, (y, x) in enumerate(np.ndindex(cells, cells)):
            corner = light[0] + light[1] * y / cells + light[2] * x / cells
            cell = outline(np.array([corner, light[1] / cells, light[2] / cells]))
            parts = (cell[[0, 1, 2]], cell[[0, 2, 3]]) if triangles else (cell,)
            lines += [f"l{k} polygon l{k}.{j}.{i} 0 0 {part.size} {words(part)}" for i, part in enumerate(parts)]
    return "\n".join((*lines, ""))


def render(
    scene: Plain,
    samples: int = 256,
    seed: int = 0,
    threads: int = 1,
    cells: int = 0,
    triangles: bool = False,
    sampling: tuple[float, ...] = (0, 0, 0, 1),
) -> tuple[Floats, str]:
    """Image and version; ``sampling`` is -ds, -dj, -dt and -dc, and 0 ``cells`` are as many as there are samples."""
    import pyradiance  # type: ignore[import-not-found]

    home = Path(pyradiance.__file__).parent
    environment = os.environ | {"RAYPATH": str(home / "lib")}
    rays = scene.centre_rays()
    rays = np.concatenate([np.broadcast_to(scene.position, rays.shape), rays], axis=1).astype("<f8")
    direct = [
        word for name, value in zip(("-ds", "-dj", "-dt", "-dc"), sampling, strict=True) for word in (name, str(value))
    ]
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        (place / "scene.rad").write_text(text(scene, cells or math.isqrt(samples), triangles))
        tree = subprocess.run(
            [home / "bin" / "oconv", place / "scene.rad"], env=environment, check=True, capture_output=True
        )
        (place / "scene.oct").write_bytes(tree.stdout)
        trace = [str(home / "bin" / "rtrace"), "-n", str(threads), *PLAIN, *direct, str(place / "scene.oct")]
        with RENDERING:
            traced = subprocess.run(trace, input=rays.tobytes(), env=environment, check=True, capture_output=True)
        said = subprocess.run([home / "bin" / "rtrace", "-version"], env=environment, capture_output=True, text=True)
    image = np.frombuffer(traced.stdout, "<f4").reshape(scene.height, scene.width, 3)
    return image, said.stdout.strip() or "Radiance"


if __name__ == "__main__":
    run(render, scale=8.0)
