"""POV-Ray, a ray tracer of 1991 that shares no code with anything else here."""

from __future__ import annotations

from nusselt.experiments.peers.peer import OnPath, Peer, Setting

POVRAY = Peer(
    name="povray",
    title="POV-Ray",
    licence="AGPL-3.0-or-later",
    rule="centre",
    noise=False,
    samples=256,
    program=OnPath("povray", "apt-get install povray"),
    megabytes=4,
    settings=(
        Setting("light_source", "n x n spotlights", "one area_light n x n", {"lamp": ""}),
        Setting(
            "area_illumination",
            "n x n spotlights",
            "one area_light n x n with area_illumination on",
            {"lamp": "area_illumination on"},
        ),
        Setting("fade_power", "2, with fade_distance 1e-3 and its colour", "none: no fall-off", {"fade": False}),
        Setting("finish ambient", "0", ".1", {"ambient": 0.1}),
        Setting("finish diffuse", "1", ".6", {"diffuse": 0.6}),
    ),
    gloss="its phong is neither normalised nor under the cosine",
    timed="what POV-Ray calls trace time",
    beware="midpoints, no noise: n × n spotlights for a light, where users take `area_light`",
    unequal=("midpoint rule of n x n points on each light: its mean error falls as 1/n^2",),
)
