"""LuxCore, LuxCoreRender's path tracer."""

from __future__ import annotations

from nusselt.experiments.peers.peer import Peer, Setting

LUXCORE = Peer(
    name="luxcore",
    title="LuxCore PATHCPU",
    licence="Apache-2.0",
    rule="area",
    noise=True,
    samples=64,
    packages={"": ("pyluxcore==2.11.2", "numpy==2.4.6")},
    megabytes=485,
    settings=(
        Setting("camera.screenwindow", "moved by one row", "images lie one row low", {"rows": 0.0}),
        Setting("film.filter.type", "NONE", "BLACKMANHARRIS, 2 pixels wide", {"filter": None}),
        Setting("path.pathdepth", "1", "6, and 4, 4, 6: indirect light", {"depth": None}),
        Setting("film.outputs type", "RGB", "RGB_IMAGEPIPELINE: a tone curve", {"output": "RGB_IMAGEPIPELINE"}),
        Setting(
            "camera.fieldofview",
            "of the shorter side",
            "the vertical one, taken for the longer side's",
            {"vertical": True},
        ),
    ),
    gloss="its glossy2 and metal2 are of microfacets, with Fresnel's factor",
    timed="from Start to HasDone, with its BVH",
    beware="made for light of many bounces; single precision",
    unequal=("balls are meshes of 81,920 triangles with smooth normals", "offsets of shadow rays of 1e-5 and more"),
)
