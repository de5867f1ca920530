"""POV-Ray, direct light alone, through pixel centres; no noise.

An area light of POV-Ray has no cosine of its own and no fall-off that is 1/r^2; a spotlight of radius 90, falloff 90
and tightness 1 has exactly the cosine, and fade_power 2 with a tiny fade_distance falls off as 1/r^2: n x n of them.
"""

from __future__ import annotations

import math
import re
import subprocess
import tempfile
from pathlib import Path

import numpy as np
from plain import RENDERING, Floats, Plain, normal_area, outline, run  # type: ignore[import-not-found]

FADE, OFF = 1e-3, 1e-5
"""The distance at which a light has half of its colour twice over; how far in front of the emitter it stands."""


def vector(values: Floats) -> str:
    """As POV-Ray writes it."""
    return "<" + ",".join(f"{float(value):.15g}" for value in values) + ">"


def triangle(corners: Floats) -> str:
    """As POV-Ray writes it."""
    return "triangle {" + ",".join(vector(corner) for corner in corners) + "}"


def text(scene: Plain, cells: int, lamp: str, fade: bool, ambient: float, diffuse: float) -> str:
    """POV-Ray's own scene language."""
    wide = scene.width / scene.height * scene.half_height * 2
    lines = [
        "#version 3.7; global_settings { assumed_gamma 1 max_trace_level 1 }",
        f"#default {{ finish {{ ambient {ambient} diffuse {diffuse} }} }}",
        f"camera {{ perspective location {vector(scene.position)} direction {vector(scene.look)} "
        f"up {vector(scene.up * 2 * scene.half_height)} right {vector(scene.right * wide)} }}",
    ]
    for corners, albedo in scene.meshes():
        lines.append(f"mesh {{ {' '.join(map(triangle, corners))} pigment {{ rgb {vector(albedo)} }} }}")
    for ball, albedo in scene.balls():
        lines.append(f"sphere {{ {vector(ball[:3])}, {ball[3]:.15g} pigment {{ rgb {vector(albedo)} }} }}")
    for light, radiance in scene.lamps():
        p = outline(light)
        lines.append(
            f"mesh {{ {triangle(p[[0, 1, 2]])} {triangle(p[[0, 2, 3]])} pigment {{ rgb 1 }} "
            f"finish {{ emission rgb {vector(radiance)} diffuse 0 ambient 0 }} }}"
        )
        lines += lamps(light, radiance, cells, lamp, fade)
    return "\n".join(lines)


def lamps(light: Floats, radiance: Floats, cells: int, lamp: str, fade: bool) -> list[str]:
    """What lights the scene in an emitter's place: ``lamp`` is "spots" or words of an area light."""
    normal, area = normal_area(light)
    falling = f"fade_distance {FADE} fade_power 2" if fade else ""
    colour = radiance * area / math.pi / (2 * FADE**2 if fade else 1)  # POV-Ray's fade is 2 / (1 + (r / fade)^2)
    if lamp == "spots":
        places = [(light[0] + (j + 0.5) / cells * light[1] + (i + 0.5) / cells * light[2]) for j, i in grid(cells)]
        spot = "spotlight radius 90 falloff 90 tightness 1 point_at"
        return [
            f"light_source {{ {vector(p + OFF * normal)} color rgb {vector(colour / cells**2)} "
            f"{spot} {vector(p + normal)} {falling} }}"
            for p in places
        ]
    middle = light[0] + (light[1] + light[2]) / 2 + OFF * normal
    area_light = f"area_light {vector(light[1])},{vector(light[2])},{cells},{cells}"
    return [f"light_source {{ {vector(middle)} color rgb {vector(colour)} {area_light} {lamp} {falling} }}"]


def traced(said: str) -> Floats:
    """What POV-Ray says of tracing: seconds by the clock, and of processors; NaN where it does not."""
    found = re.search(r"Trace Time:.*\(([\d.]+) seconds\)\s+using \d+ thread\(s\) with ([\d.]+) CPU-seconds", said)
    return np.array([float(value) for value in found.groups()] if found else [math.nan, math.nan])


def grid(cells: int) -> list[tuple[int, ...]]:
    """Numbers of the cells."""
    return list(np.ndindex(cells, cells))


def render(
    scene: Plain,
    samples: int = 256,
    seed: int = 0,
    threads: int = 2,
    lamp: str = "spots",
    fade: bool = True,
    ambient: float = 0.0,
    diffuse: float = 1.0,
    program: str = "povray",
) -> tuple[Floats, str]:
    """Image and version."""
    import OpenEXR

    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder, "scene.pov"), Path(folder, "image.exr")
        source.write_text(text(scene, math.isqrt(samples), lamp, fade, ambient, diffuse))
        size = (f"+W{scene.width}", f"+H{scene.height}")
        words = [program, f"+I{source}", f"+O{target}", "+FE", *size, "-D", "-P", "-A", f"+WT{threads}"]
        done = subprocess.run(words, check=True, capture_output=True, text=True)
        RENDERING.spent += traced(done.stderr)
        with OpenEXR.File(str(target)) as file:
            pixels = np.asarray(next(iter(file.channels().values())).pixels, dtype=float)[..., :3]
    said = subprocess.run([program, "--version"], capture_output=True, text=True)
    version = next((line for line in (said.stdout + said.stderr).splitlines() if line.startswith("POV-Ray")), "POV-Ray")
    return pixels, version


if __name__ == "__main__":
    run(render, scale=8.0)
