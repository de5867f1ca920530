"""Writes experiments/studies/stability/oracles-*.json: python tests/support/make_oracles.py. Ten minutes; mpmath alone.

A case: kind (E irradiance, I lobe), name, x, n, P, e1, e2, w, s, oracle (25 digits, for exactly the float64 numbers
written) and condition: how many times a relative change of the inputs is found again in the value, the largest of
four random perturbations of 1e-12.
"""

from __future__ import annotations

import json
import math
import random
from pathlib import Path
from typing import Any

from mpmath import mp, mpf
from oracle_formulas import irradiance, lobe, lobe_by_polar_angle, precise
from places import ROOT

Case = dict[str, Any]
UP = [0.0, 0.0, 1.0]
UNIT = ([-0.5, -0.5, 2.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
VECTORS = ("x", "n", "P", "e1", "e2", "w")


def case(
    name: str, light: Any = UNIT, x: Any = (0.0, 0.0, 0.0), n: Any = UP, w: Any = None, s: float | None = None
) -> Case:
    """One case; with ``w`` and ``s`` a lobe."""
    out: Case = {"kind": "E" if w is None else "I", "name": name, "x": x, "n": n}
    out.update(zip(("P", "e1", "e2"), light, strict=True))
    if w is not None:
        out.update(w=w, s=s)
    return {k: [float(c) for c in v] if k in VECTORS else v for k, v in out.items()}


def square(half: float, z: float, at: tuple[float, float] = (0.0, 0.0)) -> Any:
    """A level square light."""
    return [at[0] - half, at[1] - half, z], [2 * half, 0, 0], [0, 2 * half, 0]


def wall(z: float, height: float, x: float = 1.0) -> Any:
    """An upright light from z to z + height."""
    return [x, -0.5, z], [0, 1, 0], [0, 0, height]


def moved(light: Any, by: list[float], scale: float = 1.0) -> Any:
    p, e1, e2 = ([scale * c for c in v] for v in light)
    return [a + b for a, b in zip(p, by, strict=True)], e1, e2


def irradiances() -> list[Case]:
    """Every row of stiff and extreme cases that an irradiance can show."""
    tilted = ([0.3, -0.7, 1.1], [0.9, 0.2, -0.3], [-0.1, 0.8, 0.4])
    sideways = [1.0, 0.2, 0.1]
    cases = [case("square overhead"), case("tilted light, tilted receiver", tilted, n=[0.2, -0.1, 1.3])]
    for z in (-0.5, -0.9, -1e-3, -1 + 1e-3, -1 + 1e-6, -1 + 1e-9, -1 + 1e-12):
        cases.append(case(f"upright light across the horizon, {1 + z:.3g} of it above", wall(z, 1.0)))
    cases.append(case("upright light that touches the horizon along an edge, from above", wall(0.0, 1.0)))
    cases.append(case("upright light that touches the horizon along an edge, from below", wall(-1.0, 1.0)))
    cases.append(case("a corner that touches the horizon", ([1, 0, 0], [0.3, 0.5, 0.5], [0.3, -0.5, 0.5])))
    cases.append(case("a diagonal along the horizon", ([1, -1, 0], [0.5, 1, 1], [-0.5, 1, -1])))
    cases.append(case("below the horizon", wall(-2.0, 1.0)))
    cases.append(case("edge-on", square(0.5, 0.0, (2.0, 0.0)), n=sideways))
    cases.append(case("edge-on, the point on an edge's line", square(0.5, 0.0, (2.0, 0.5)), n=sideways))
    cases.append(case("no area: one side is 0", (UNIT[0], UNIT[1], [0, 0, 0])))
    cases.append(case("no area: parallel sides", (UNIT[0], [1, 2, 3], [2, 4, 6])))
    for h in (1e-1, 1e-3, 1e-6, 1e-9, 1e-12, 1e-15):
        cases.append(case(f"{h:g} below a level light", square(0.5, h)))
        cases.append(case(f"{h:g} below the light's plane, beside it", square(0.5, h, (1.0, 0.0))))
        cases.append(case(f"{h:g} below the light's plane, facing along it", square(0.5, h, (1.0, 0.1)), n=sideways))
    for h in (1e-3, 1e-6, 1e-9):
        cases.append(case(f"{h:g} below a light's edge", square(0.5, h, (0.5, 0.0))))
        cases.append(case(f"{h:g} outside a light's corner, {h:g} below", square(0.5, h, (0.5 + h, 0.5 + h))))
        cases.append(case(f"light 1 long, {h:g} wide", ([-0.5, 0.2, 1], [1, 0, 0], [0, h, 0])))
        cases.append(case(f"light {1 / h:g} long, 1 wide", ([-0.5 / h, -0.3, 1], [1 / h, 0, 0], [0, 1, 0])))
        cases.append(case(f"sides at an angle of {h:g}", ([-0.5, 0.2, 1], [1, 0, 0], [1, h, 0])))
        cases.append(case(f"upright needle {h:g} above the horizon", ([1, 0, h], [0, 1, 0], [0, 0, h])))
    for size in (1e-2, 1e-4, 1e-6, 1e-8):
        light = ([0.3, 0.2, 1], [size, 0, 0.1 * size], [0, size, -0.2 * size])
        cases.append(case(f"solid angle {size * size:g}", light))
    for distance in (1e3, 1e6, 1e9):
        cases.append(case(f"unit light at {distance:g}", moved(UNIT, [0.3 * distance, 0, distance])))
    for half in (1e2, 1e5, 1e8):
        cases.append(case(f"half width {half:g} at height 1, tilted receiver", square(half, 1.0), n=[0.3, 0.1, 1]))
    for scale in (1e-30, 1e-12, 1e-6, 1e9, 1e30):
        cases.append(case(f"scale {scale:g}", moved(tilted, [0, 0, 0], scale), n=[0.1, 0, 1]))
    for offset in (1e3, 1e6, 1e9):
        by = [offset, -2 * offset, 3 * offset]
        cases.append(case(f"offset {offset:g}", moved(tilted, by), x=by))
    return cases


def lobes() -> list[Case]:
    """The same for the lobe."""
    cases = []
    inside, edge, beside, behind = [0.1, 0.05, 1.0], [0.5, 0.05, 2.0], [0.75, 0.05, 2.0], [-1.0, 0.3, 0.4]
    for s in (0.0, 1.0, 2.5, 10.0, 50.0, 300.0, 1e4, 1e6):
        cases.append(case(f"exponent {s:g}, inside the light", w=inside, s=s))
        cases.append(case(f"exponent {s:g}, on the light's edge", w=edge, s=s))
    for s in (0.5, 20.0, 200.0, 2000.0, 2e4):
        cases.append(case(f"exponent {s:g}, a tenth of a radian outside", w=beside, s=s))
    for s in (0.0, 5.0, 40.0, 200.0):
        cases.append(case(f"exponent {s:g}, a radian outside", w=behind, s=s))
    for s in (1.0, 10.0, 100.0):
        cases.append(case(f"exponent {s:g}, across the lobe's own horizon", wall(0.1, 1.0), w=[-0.5, 0.2, 1.0], s=s))
        cases.append(case(f"exponent {s:g}, across both horizons", wall(-0.5, 1.0), w=[0.1, 0.6, 0.05], s=s))
        cases.append(case(f"exponent {s:g}, mirror direction below", wall(-0.3, 1.0), w=[1.0, 0.0, -0.1], s=s))
    for size, s in ((1e-3, 1e4), (1e-5, 1e4), (1e-8, 1e6), (1e-6, 30.0), (1e-6, 0.0)):
        light = ([0.3, 0.2, 0.93], [size, 0, 0], [0, size, 0])
        cases.append(case(f"exponent {s:g}, light of {size:g}", light, w=[0.3, 0.2, 0.93], s=s))
        cases.append(case(f"exponent {s:g}, light of {size:g}, off the peak", light, w=[0.32, 0.2, 0.93], s=s))
    for h in (1e-3, 1e-6, 1e-9):
        cases.append(case(f"exponent 20, {h:g} below the light", square(0.5, h), w=[0.3, 0.0, 1.0], s=20.0))
        cases.append(case(f"exponent 20, grazing {h:g}", square(0.5, h, (1.0, 0.0)), w=[1.0, 0.1, 0.2], s=20.0))
        cases.append(case(f"exponent 20, {h:g} above the horizon", wall(h - 1, 1.0), w=[1.0, 0.1, 0.1], s=20.0))
        cases.append(
            case(f"exponent 50, needle {h:g} wide", ([-0.5, 0, 1], [1, 0, 0], [0, h, 0]), w=[0.1, 0, 1], s=50.0)
        )
    for scale in (1e-30, 1e30):
        cases.append(case(f"exponent 30, scale {scale:g}", moved(UNIT, [0, 0, 0], scale), w=inside, s=30.0))
    by = [1e9, 2e9, -1e9]
    cases.append(case("exponent 30, offset 1e9", moved(UNIT, by), x=by, w=inside, s=30.0))
    cases.append(case("exponent 30, half width 1e8", square(1e8, 1.0), w=[1.0, 0.2, 0.3], s=30.0))
    cases.append(case("exponent 10, below the horizon", wall(-2.0, 1.0), w=inside, s=10.0))
    cases.append(case("exponent 10, edge-on", square(0.5, 0.0, (2.0, 0.0)), n=[1, 0.2, 0.1], w=[1.0, 0, 0], s=10.0))
    return cases


def stiff(seed: int, count: int, kind: str) -> list[Case]:
    """Sizes 1e-8 .. 1e2, heights 1e-9 .. 3, offsets to 1e3, any tilt; exponents 0 .. 50."""
    r = random.Random(seed)

    def direction() -> list[float]:
        return [r.gauss(0, 1) for _ in range(3)]

    def logarithmic(low: float, high: float) -> float:
        return math.exp(r.uniform(math.log(low), math.log(high)))

    cases = []
    for k in range(count):
        n = direction() if r.random() < 0.5 else UP
        tilt = direction() if r.random() < 0.5 else UP
        a = _across(tilt, direction())
        b = _across(tilt, direction())
        place = [r.uniform(-2, 2), r.uniform(-2, 2), logarithmic(1e-9, 3)]
        offset = r.choice([0.0, logarithmic(1e-3, 1e3)])
        x = [offset * c for c in direction()]
        e1, e2 = ([logarithmic(1e-8, 1e2) * c for c in v] for v in (a, b))
        w, s = (direction(), r.choice([0.0, 1.0, r.uniform(0, 50), r.uniform(0, 50)])) if kind == "I" else (None, None)
        corner = [p + q - 0.5 * (u + v) for p, q, u, v in zip(place, x, e1, e2, strict=True)]
        cases.append(case(f"random {kind} {k}", (corner, e1, e2), x=x, n=n, w=w, s=s))
    return cases


def _across(n: list[float], v: list[float]) -> list[float]:
    """A unit vector across n."""
    out = [n[1] * v[2] - n[2] * v[1], n[2] * v[0] - n[0] * v[2], n[0] * v[1] - n[1] * v[0]]
    length = math.sqrt(sum(c * c for c in out))
    return [c / length for c in out]


def value(one: Case) -> mpf:
    return precise(irradiance if one["kind"] == "E" else lobe, one)


def condition(one: Case, exact: mpf) -> float:
    """Largest relative change of the value over that of the inputs."""
    if not exact:
        return 0.0
    r, worst = random.Random(1), mpf(0)
    with mp.workdps(50):
        for _ in range(4):
            shaken = {
                k: [mpf(c) * (1 + r.uniform(-1, 1) * mpf("1e-12")) for c in v] if k in VECTORS else v
                for k, v in one.items()
            }
            worst = max(worst, abs(value(shaken) / exact - 1))
    return float(worst * mpf(10) ** 12)


def solved(cases: list[Case], with_condition: bool) -> list[Case]:
    out = []
    for one in cases:
        exact = value(one)
        with mp.workdps(30):
            one["oracle"] = mp.nstr(exact, 25)
        if with_condition:
            one["condition"] = float(f"{condition(one, exact):.3g}")
        out.append(one)
    return out


def second_method(cases: list[Case]) -> float:
    """Largest disagreement of the lobe with its integral in polar coordinates, over every fifth case."""
    worst = mpf(0)
    for one in [c for c in cases if c["kind"] == "I" and 0.5 <= c["s"] <= 300][::5]:
        exact = mpf(one["oracle"])
        if exact:
            worst = max(worst, abs(precise(lobe_by_polar_angle, one) / exact - 1))
    return float(worst)


def write(path: Path, cases: list[Case]) -> None:
    lines = ",\n".join(json.dumps(one) for one in cases)
    path.write_text(f"[\n{lines}\n]\n")


def main() -> None:
    folder = ROOT / "experiments" / "studies" / "stability"
    with mp.workdps(40):
        for name, cases, conditions in (
            ("stiff", irradiances() + lobes(), True),
            ("random", stiff(1, 250, "E") + stiff(2, 150, "I"), False),
        ):
            done = solved(cases, conditions)
            write(folder / f"oracles-{name}.json", done)
            print(name, len(done), "second method differs by", second_method(done), flush=True)


if __name__ == "__main__":
    main()
