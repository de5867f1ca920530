"""Mitsuba 3, whose `direct` the bridge runs."""

from __future__ import annotations

from nusselt.experiments.peers.peer import Peer, Setting

MITSUBA = Peer(
    name="mitsuba",
    title="Mitsuba 3 direct",
    licence="BSD-3-Clause",
    rule="area",
    noise=True,
    samples=64,
    within="mitsuba",
    megabytes=290,
    settings=(Setting("sampler", "multijitter", "independent: noise", {"sampler": "independent"}),),
    timed="`mi.render`, or rays through centres, kernels compiled before",
    beware="compiling is start-up; light sampling alone, multijitter; its wavefronts are made for many cores",
    unequal=("single precision throughout; each sample picks one light",),
)
