"""Rounds of laps, all sides in turn, each lap kept as soon as it is done."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import ExitStack
from dataclasses import asdict, dataclass, field

from nusselt.experiments.check.estimators import noise_free
from nusselt.experiments.check.question import PixelRule, with_pixel_rule
from nusselt.experiments.external.program import ProgramFailed
from nusselt.experiments.peers.peer import Peer
from nusselt.experiments.peers.renderer import PeerRenderer, renderer_of
from nusselt.experiments.results.store import Store, key_of
from nusselt.renderer.errors import InputError
from nusselt.renderer.image import render
from nusselt.renderer.pixels import render_area
from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Bools

from .sides import Lap, MitsubaSide, OwnSide, PeerSide, Side, Truth

TOLERANCE = 2.5e-5
"""Of the exact image by area."""
THREADS = 1
"""Of every side: then seconds of processors are what a quiet machine takes, and no side is judged by its scaling."""
LONGEST = 8.0
"""Processor seconds that a lap may be expected to take, from the one before it."""
RULES: tuple[PixelRule, ...] = ("centre", "area")
OURS = Peer(
    name="nusselt",
    title="Nusselt, without noise",
    licence="",
    rule="area",
    noise=False,
    samples=0,
    settings=(),
    unequal=(),
    megabytes=0,
    timed="the image, another of 8 pixels across before it",
    beware="direct light from polygons alone; a centre's error is 0 as it is the exact image itself",
)


@dataclass
class Times:
    """All laps of one scene.

    Parameters
    ----------
    laps : dict
        By the side's name and rule.
    sides : dict
    failed : dict
        Why a side stopped.
    """

    laps: dict[tuple[str, PixelRule], list[Lap]] = field(default_factory=dict)
    sides: dict[tuple[str, PixelRule], Side] = field(default_factory=dict)
    failed: dict[tuple[str, PixelRule], str] = field(default_factory=dict)


def truths_of(scene: Scene, judged: Bools, executor: Executor | None = None) -> dict[PixelRule, Truth]:
    """The exact images that errors are measured against.

    Raises
    ------
    InputError
        If the scene has none.
    """
    exact = noise_free(scene)
    if exact is None:
        raise InputError("scene", scene.name, "one with an exact image, which errors against time are measured by")
    centre = render(with_pixel_rule(scene, "centre"), exact, executor=executor).mean
    area = render_area(with_pixel_rule(scene, "area"), exact, tolerance=TOLERANCE, executor=executor).image.mean
    return {"centre": Truth(centre, judged), "area": Truth(area, judged)}


def sides_of(
    scene: Scene, truths: Mapping[PixelRule, Truth], ready: Sequence[PeerRenderer], stack: ExitStack
) -> list[Side]:
    """Ours, Mitsuba by both rules, and each peer by its own."""
    exact, sides = noise_free(scene), list[Side]()
    if exact is not None:
        sides += [OwnSide(OURS, rule, scene, truths[rule], exact) for rule in RULES]
    for one in ready:
        if one.peer.within:
            sides += [MitsubaSide(one.peer, rule, scene, truths[rule], THREADS, one.timeout) for rule in RULES]
        else:
            timed = renderer_of(one.peer, one.launch, scene, one.timeout, THREADS)
            sides.append(PeerSide(stack.enter_context(timed), truths[one.peer.rule]))
    return sides


def measure(
    scene: Scene, sides: Sequence[Side], rounds: int, seed: int, store: Store, tell: Callable[[int, int], None]
) -> Times:
    """Laps of all sides: in each round all of one size in turn, another side first each time, then the next size.

    A side that fails goes no further; one is spared sizes that would take longer than `LONGEST`.
    """
    found, steps = Times(), max(len(side.sizes) for side in sides)
    for side in sides:
        key = (side.peer.name, side.rule)
        found.sides[key], found.laps[key] = side, []
    done, total = 0, rounds * steps * len(sides)
    for number in range(rounds):
        for step in range(steps):
            first = (number + step) % len(sides)
            for side in (*sides[first:], *sides[:first]):
                _turn(scene, side, step, number, seed, found, store)
                done += 1
                tell(done, total)
    return found


def _turn(scene: Scene, side: Side, step: int, number: int, seed: int, found: Times, store: Store) -> None:
    key = (side.peer.name, side.rule)
    laps = found.laps[key]
    if step >= len(side.sizes) or key in found.failed or _too_long(side, step, number, laps):
        return
    size = side.sizes[step]
    code = side.peer.adapter.read_text(encoding="utf-8") if side.peer.adapter.is_file() else ""
    name = key_of("lap", scene, side.peer.name, side.rule, code, size, number, seed, THREADS, TOLERANCE)
    lap = store.find(name, lambda words, _: Lap(**words["lap"]))
    if lap is None:
        try:
            lap = side.lap(size, number, seed + 1000 * number + step)
        except ProgramFailed as problem:
            found.failed[key] = str(problem)
            return
        store.keep(name, {"renderer": side.peer.name, "pixel_rule": side.rule, "lap": asdict(lap)}, {})
    laps.append(lap)


def _too_long(side: Side, step: int, number: int, laps: Sequence[Lap]) -> bool:
    """Whether this round's last lap was left out, or says that the next would take too long."""
    if not step:
        return False
    last = [lap for lap in laps if lap.round == number and lap.size == side.sizes[step - 1]]
    more = max(side.sizes[step] / side.sizes[step - 1], 1.0)
    return not last or last[0].processor * more > LONGEST
