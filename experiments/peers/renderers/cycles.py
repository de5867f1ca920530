"""Cycles, Blender's path tracer."""

from __future__ import annotations

from nusselt.experiments.peers.peer import OnPath, Peer, Setting

CYCLES = Peer(
    name="cycles",
    title="Blender Cycles",
    licence="GPL-3.0-or-later (Blender), Apache-2.0 (Cycles)",
    rule="area",
    noise=True,
    samples=64,
    packages={"3.11": ("bpy==5.0.1",), "3.13": ("bpy==5.2.3",)},
    program=OnPath(
        "blender",
        "its own download or a distribution's",
        ("--background", "--factory-startup", "--python-exit-code", "1", "--python"),
    ),
    megabytes=900,
    settings=(
        Setting("pixel_filter_type", "BOX", "BLACKMAN_HARRIS, 1.5 pixels wide", {"filter": None, "width": None}),
        Setting("max_bounces, diffuse_bounces", "0", "12 and 4: indirect light", {"bounces": None}),
        Setting("use_denoising", "off", "on (OpenImageDenoise)", {"denoise": None}),
        Setting("use_adaptive_sampling", "off", "on, at .01", {"adaptive": None}),
        Setting("emission", "on the front alone", "on both sides", {"lamps": False, "one_sided": False}),
        Setting("emitters", "area lamps", "meshes that emit", {"lamps": False}),
        Setting("visible_camera of a lamp", "on", "off: no lamp is seen, −100 % of its own pixels", {"seen": None}),
        Setting(
            "camera.sensor_fit",
            "VERTICAL",
            "AUTO: the vertical angle taken for the larger side's",
            {"sensor_fit": None},
        ),
        Setting("strength of a new world's background", "0", "1, of a grey of .05", {"world": None}),
        Setting("light_sampling_threshold", "0", ".01", {"threshold": None}),
    ),
    gloss="its glossy lobes are of microfacets: GGX, Beckmann, Ashikhmin-Shirley",
    timed="`render.render`, with synchronisation, BVH and EXR",
    beware="made for films' scenes and many cores; single precision",
    unequal=(
        "balls are meshes of 327,680 triangles with smooth normals",
        "parallelograms that are no rectangles are meshes that emit, 0.02 % dim and more in large units: scenes are "
        "made small",
        "single precision throughout",
    ),
)
