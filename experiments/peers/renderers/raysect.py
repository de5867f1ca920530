"""Raysect, a scientific ray tracer of the fusion community."""

from __future__ import annotations

from nusselt.experiments.peers.peer import Peer, Setting

RAYSECT = Peer(
    name="raysect",
    title="Raysect",
    licence="BSD-3-Clause",
    rule="area",
    noise=True,
    samples=32,
    packages={"": ("raysect==0.9.1", "numpy==2.4.6", "scipy==1.17.1", "matplotlib==3.11.2")},
    megabytes=389,
    settings=(
        Setting(
            "PinholeCamera",
            "its cosine divided out",
            "every ray weighted by its cosine to the axis",
            {"cosine_undone": False},
        ),
        Setting("UniformSurfaceEmitter", "an absorbing plate behind", "shines to both sides", {"one_sided": False}),
        Setting("ray_max_depth", "2: direct light", "100: indirect light", {"depth": 100}),
        Setting(
            "PinholeCamera fov",
            "of the longer side",
            "the vertical one, taken for the longer side's",
            {"vertical": True},
        ),
        Setting("ray_important_path_weight", ".99", ".25: noise", {"path_weight": 0.25}),
    ),
    gloss="its rough conductor is of microfacets (GGX), with Fresnel's factor",
    timed="`camera.observe`",
    beware="spectral, in double precision; samples the ball about a light, not its area",
    unequal=(
        "emitters are sampled by the ball about them: very noisy",
        "rays start 1e-6 off (absolute), meshes are met at distances of single precision: scenes are made small",
    ),
)
