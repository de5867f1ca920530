"""A cross-check and the list of peers in a terminal."""

from __future__ import annotations

from collections.abc import Sequence

from rich import box
from rich.markup import escape
from rich.table import Table

from nusselt.experiments.results.rows import percent
from nusselt.experiments.results.tables import COLOURS

from .cross import Cross
from .environment import Environments
from .peer import Peer
from .times.measure import Times
from .times.rows import time_rows
from .times.words import CAPTION, TIME_COLUMNS, time_cells


def peers_table(peers: Sequence[Peer], environments: Environments) -> Table:
    """Every peer, whether it is there, and what would bring it."""
    table = Table(box=box.SIMPLE, caption=f"environments in {environments.folder}")
    for name in ("peer", "renderer", "there", "pixels", "noise", "MB", "Python", "packages", "licence"):
        table.add_column(name, justify="right" if name == "MB" else "left", overflow="fold")
    for peer in peers:
        there = environments.launch(peer) is not None
        pythons = " ".join(version or "any" for version in peer.packages)
        packages = " or ".join(" ".join(names) for names in peer.packages.values())
        status = "yes" if there else environments.status(peer)
        noise = "yes" if peer.noise else "none"
        cells = (peer.name, peer.title, status, peer.rule, noise, str(peer.megabytes), pythons, packages, peer.licence)
        table.add_row(*map(escape, cells))
    return table


def matrix_table(cross: Cross) -> Table:
    """Each renderer against the exact image and against the others: bias in %, its interval's half, RMS."""
    table = Table(
        box=box.SIMPLE,
        title=f"{cross.scene.name}: each row less each column, % of the mean",
        caption=f"exact: {cross.arbiter.said}; ± half of the interval; RMS without noise",
    )
    names = [entrant.name for entrant in cross.entrants]
    for column in ("", "less exact", "RMS", "z", "finds", *names):
        table.add_column(column, justify="left" if not column else "right")
    for name in names:
        own = cross.exact[name]
        half = (own.interval[1] - own.interval[0]) / 2
        told = f"[{COLOURS[own.word]}]{percent(own.bias, 4, sign=True, unit='')}[/] ± {percent(half, 4, unit='')}"
        cells = [told, percent(own.rms, unit=""), f"{own.z:+.1f}", percent(own.finds, unit="")]
        for other in names:
            pair = cross.pairs.get((name, other))
            shown = percent(pair.bias, 4, sign=True, unit="") if pair else ""
            cells.append(f"[{COLOURS[pair.word]}]{shown}[/]" if pair else shown)
        table.add_row(escape(name), *cells)
    return table


def departures_table(crosses: Sequence[Cross]) -> Table:
    """Renderer x setting left x size of error on each scene."""
    table = Table(box=box.SIMPLE, title="Settings left at their defaults: bias and RMS, %")
    for column in ("renderer", "setting", "used", "left", *(cross.scene.name for cross in crosses)):
        table.add_column(column, overflow="fold")
    for row in departure_rows(crosses):
        table.add_row(*map(escape, row))
    return table


def times_table(scene: str, times: Times) -> Table:
    """Seconds of rendering to each error, and to Mitsuba's."""
    table = Table(box=box.SIMPLE, title=f"{scene}: processor seconds to an error", caption=CAPTION)
    rows = time_rows(scene, times)
    for column in TIME_COLUMNS:
        table.add_column(column, overflow="fold")
    for row in rows:
        table.add_row(*map(escape, time_cells(row)))
    return table


def departure_rows(crosses: Sequence[Cross]) -> list[tuple[str, ...]]:
    """Renderer, setting, used, left, and "bias, RMS" of each scene, in percent."""
    found: dict[tuple[str, ...], dict[int, str]] = {}
    for k, cross in enumerate(crosses):
        for one in cross.departures:
            key = (one.version or one.peer, one.setting.what, one.setting.used, one.setting.left)
            figures = one.found
            told = (
                "no image"
                if figures is None
                else (
                    f"{percent(figures.bias, sign=True, unit='')} ± {percent(figures.standard_error, unit='')}, "
                    f"{percent(figures.rms, 2, unit='')}"
                )
            )
            found.setdefault(key, {})[k] = told
    return [(*key, *(by_scene.get(k, "") for k in range(len(crosses)))) for key, by_scene in found.items()]
