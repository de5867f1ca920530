"""A cross-check and the list of peers in a terminal."""

from __future__ import annotations

from collections.abc import Sequence

from rich import box
from rich.console import Group
from rich.table import Table
from rich.text import Text

from nusselt.experiments.results.rows import percent
from nusselt.experiments.results.schema import Row
from nusselt.experiments.results.study_tables import GAP, blocks, table
from nusselt.experiments.results.tables import COLOURS

from .compare import Difference
from .cross import Cross
from .environment import Environments
from .peer import Peer
from .times.measure import Times
from .times.rows import time_rows
from .times.words import CAPTION, TIME_COLUMNS, time_cells


def peers_table(peers: Sequence[Peer], environments: Environments, width: int) -> Group:
    """Every peer, whether it is there, and what would bring it."""
    rows: list[Row] = [
        {
            "peer": peer.name,
            "renderer": peer.title,
            "there": "yes" if environments.launch(peer) is not None else environments.status(peer),
            "pixels": peer.rule,
            "noise": "yes" if peer.noise else "none",
            "MB": peer.megabytes,
            "Python": " ".join(version or "any" for version in peer.packages),
            "licence": peer.licence,
            "packages": " or ".join(" ".join(names) for names in peer.packages.values()),
        }
        for peer in peers
    ]
    return Group(table(rows, "Other renderers", width), f"environments in {environments.folder}")


def matrix_table(cross: Cross, width: int) -> Group:
    """Each renderer against the exact image and against the others: bias in %, its interval's half, RMS."""
    names = [entrant.name for entrant in cross.entrants]
    columns: dict[str, list[Text]] = {"": [Text(name) for name in names]}
    every = [cross.exact[name] for name in names]
    halves = [percent((own.interval[1] - own.interval[0]) / 2, 4, unit="") for own in every]
    columns["less exact"] = [_bias(own).append(f" ± {half}") for own, half in zip(every, halves, strict=True)]
    columns["RMS"] = [Text(percent(own.rms, unit="")) for own in every]
    columns["z"] = [Text(f"{own.z:+.1f}") for own in every]
    columns["MDB"] = [Text(percent(own.finds, unit="")) for own in every]
    for other in names if len(names) > 1 else ():
        columns[other] = [_bias(cross.pairs.get((name, other))) for name in names]
    sizes = {head: GAP + max(len(head), *map(len, cells)) for head, cells in columns.items()}
    parts: list[Table | str] = []
    for heads in blocks(sizes, [""], width):
        title = None if parts else f"{cross.scene.name}: each row less each column, % of the mean"
        found = Table(box=box.SIMPLE, title=title)
        for head in heads:
            found.add_column(head, justify="right" if head else "left", no_wrap=True)
        for cells in zip(*(columns[head] for head in heads), strict=True):
            found.add_row(*cells)
        parts.append(found)
    told = f"exact: {cross.arbiter.said}; ± half of the interval; RMS without noise; MDB: minimum detectable bias"
    return Group(*parts, told)


def _bias(found: Difference | None) -> Text:
    """In %, in the colour of its verdict; empty where nothing was compared."""
    cell = Text()
    return cell.append(percent(found.bias, 4, sign=True, unit=""), COLOURS[found.word]) if found else cell


def departures_table(crosses: Sequence[Cross], width: int) -> Group:
    """Renderer x setting left x size of error on each scene."""
    heads = ("renderer", "setting", "used", "left", *(cross.scene.name for cross in crosses))
    rows = [dict(zip(heads, row, strict=True)) for row in departure_rows(crosses)]
    return table(rows, "Settings left at their defaults: bias and RMS, %", width)


def times_table(scene: str, times: Times, width: int) -> Group:
    """Seconds of rendering to each error, and to Mitsuba's."""
    rows = [dict(zip(TIME_COLUMNS, time_cells(row), strict=True)) for row in time_rows(scene, times)]
    return Group(table(rows, f"{scene}: processor seconds to an error", width), CAPTION)


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


def without(crosses: Sequence[Cross]) -> list[str]:
    """Who was left out, and why: once, where it is so in every scene."""
    scenes: dict[tuple[str, str], list[str]] = {}
    for cross in crosses:
        for peer, why in cross.missing.items():
            scenes.setdefault((why, peer), []).append(cross.scene.name)
    where = {key: "" if len(some) == len(crosses) else f"{', '.join(some)}: " for key, some in scenes.items()}
    return [f"{place}without {peer}: {why}" for (why, peer), place in where.items()]
