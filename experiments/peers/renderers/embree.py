"""Embree, which casts the rays of many renderers, Mitsuba and Cycles among them; the estimator is the adapter's."""

from __future__ import annotations

from nusselt.experiments.peers.peer import Peer, Setting

EMBREE = Peer(
    name="embree",
    title="Embree as caster",
    licence="Apache-2.0 (Embree), MIT (embreex)",
    rule="centre",
    noise=True,
    samples=64,
    packages={"": ("embreex==4.4.0", "numpy==2.4.6")},
    megabytes=139,
    settings=(
        Setting(
            "shadow rays",
            "from 1e-4 off the surface to 1e-4 before the light",
            "from the surface to the light",
            {"offset": 0.0, "gap": 0.0},
        ),
        Setting("shadow rays' start", "1e-4 off the surface", "1e-2 off the surface", {"offset": 1e-2}),
    ),
    timed="the adapter's rays",
    beware="Embree casts the rays, in single precision; all else is a NumPy script's",
    unequal=(
        "single precision: hit points are found anew in double, hits are not",
        "balls are meshes of 81,920 triangles with exact normals; no ray meets their vertices exactly",
    ),
)
