"""Ten mistakes of the independent renderer, each in a scene of 53 objects that is made small: what is left of it.

    python tests/support/reduce_many.py --seed 1

The cause is unchanged if the smallest scene fails as the whole one did, and does not without the mistake.
"""

from __future__ import annotations

import argparse
import math
import time
from dataclasses import replace

import numpy as np
from builders import box, floor, lamp, scene

from nusselt.experiments.independent.mistakes import MISTAKES
from nusselt.experiments.metamorphic.ask import Asking
from nusselt.experiments.reduce.failure import manner_of
from nusselt.experiments.reduce.reduce import Trials, reduced
from nusselt.experiments.studies.metamorphic_mistakes import IndependentSource
from nusselt.renderer.scene import Scene
from nusselt.renderer.surfaces import Ellipsoid, Material

PLANTED = (
    "no surface cosine",
    "no light cosine",
    "area of a triangle",
    "centre of the light",
    "balls do not block",
    "triangles do not block",
    "lights do not block",
    "albedo twice",
    "half vector",
    "no lobe",
)
SHINY = Material((0.3, 0.3, 0.3), (0.4, 0.4, 0.4), 10.0)


def many(rng: np.random.Generator) -> Scene:
    """A floor, 40 boxes and 12 balls, half of them glossy, under two lights, one of them before the other."""
    places = rng.uniform([-1.8, 0.2, -1.8], [1.8, 0.9, 1.8], (52, 3))
    boxes = [box(tuple(p - 0.12), tuple(p + 0.12)) for p in places[:40]]
    boxes = [replace(one, material=SHINY) if k % 2 else one for k, one in enumerate(boxes)]
    balls = tuple(Ellipsoid.sphere(tuple(p), 0.15, *((SHINY,) if k % 2 else ())) for k, p in enumerate(places[40:]))
    lights = lamp(2.5), lamp(3.5, 0.3, (60.0, 60.0, 60.0))
    return scene(floor(), *boxes, lights=lights, ellipsoids=balls, size=(32, 24), light_samples=16, stratify=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    rng, asking = np.random.default_rng(parser.parse_args().seed), Asking(margin=0.01)
    by_name, good = {mistake.name: mistake for mistake in MISTAKES}, 0
    for name in PLANTED:
        whole, source, started = many(rng), IndependentSource(by_name[name].steps), time.process_time()
        failure, _ = manner_of(whole, source, asking)
        if failure is None:
            print(f"{name}: does not fail")
            continue
        trials = Trials(failure, math.inf)
        small, seconds = reduced(whole, trials), time.process_time() - started
        left, right = len(small.meshes) + len(small.ellipsoids), replace(failure, source=IndependentSource())
        same = failure.there(small) and not right.there(small)
        good += same and left <= 4 and seconds < 600
        print(
            f"{name}: {failure.manner}; 53 objects became {left}, {len(small.lights)} lights, {small.width} x "
            f"{small.height}, {trials.asked} trials, {seconds:.0f} s; {'the same cause' if same else 'another cause'}",
            flush=True,
        )
    print(f"{good} of {len(PLANTED)} have at most 4 objects within 600 s of one core and the same cause")


if __name__ == "__main__":
    with np.errstate(all="ignore"):  # mistakes divide by what they like
        main()
