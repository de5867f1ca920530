"""The peers, each listed once: commands, page, tests and documents go through this tuple."""

from __future__ import annotations

from nusselt.experiments.peers.peer import Peer
from nusselt.renderer.errors import InputError

from .cycles import CYCLES
from .embree import EMBREE
from .luxcore import LUXCORE
from .mitsuba import MITSUBA
from .povray import POVRAY
from .radiance import RADIANCE
from .raysect import RAYSECT

PEERS: tuple[Peer, ...] = (MITSUBA, RADIANCE, POVRAY, EMBREE, CYCLES, LUXCORE, RAYSECT)


def peer_of(name: str) -> Peer:
    """A peer by its name.

    Raises
    ------
    InputError
    """
    by_name = {peer.name: peer for peer in PEERS}
    if name not in by_name:
        raise InputError("peer", name, "one of " + ", ".join(by_name))
    return by_name[name]
