"""Radiance, which architects and lighting engineers trust since 1989."""

from __future__ import annotations

from nusselt.experiments.peers.peer import Peer, Setting

RADIANCE = Peer(
    name="radiance",
    title="Radiance rtrace",
    licence="Radiance Software License (BSD-like)",
    rule="centre",
    noise=False,
    samples=256,
    packages={"": ("pyradiance==1.3.1", "numpy==2.4.6")},
    megabytes=118,
    settings=(
        Setting(
            "-ds",
            "0, on a light cut into n x n sources",
            ".2 on one source, as rtrace does",
            {"cells": 1, "sampling": [0.2, 0, 0.03, 0.75]},
        ),
        Setting(
            "-ds -dt -dc of rpict",
            "the same",
            ".25 .05 .5, as rpict does",
            {"cells": 1, "sampling": [0.25, 0, 0.05, 0.5]},
        ),
        Setting(
            "-ds below .1",
            "the same",
            ".02: a guess at finer; 64 points of a source at most",
            {"cells": 1, "sampling": [0.02, 0, 0, 1]},
        ),
        Setting("-dt -dc", "0 1: every source tested", ".03 .75, as rtrace does", {"sampling": [0, 0, 0.03, 0.75]}),
        Setting(
            "source polygons",
            "parallelograms",
            "triangles, sampled outside themselves too",
            {"cells": 1, "triangles": True, "sampling": [0.05, 0, 0, 1]},
        ),
    ),
    gloss="its plastic and metal have Ward's Gaussian lobe; Phong's as a BRTDfunc is not written by the adapter",
    timed="rtrace, its start with it",
    beware="midpoints, no noise; `oconv` is start-up; made for indirect light",
    unequal=(
        "midpoint rule of n x n points on each light: its mean error falls as 1/n^2",
        "surfaces closer than 1e-4 of a unit are one (absolute)",
    ),
)
