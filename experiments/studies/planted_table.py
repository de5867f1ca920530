"""`python -m nusselt.experiments.studies.planted_table`: every planted mistake and what it is taken for."""

from __future__ import annotations

import argparse
import sys
import time

from rich import box
from rich.table import Table

from nusselt.experiments.external.diagnosis import diagnose
from nusselt.experiments.images.formats import Raw
from nusselt.experiments.images.transfer import Quantiser, Transfer
from nusselt.experiments.results.document import document, write_json
from nusselt.experiments.results.tables import console
from nusselt.experiments.studies.planted_mistakes import PLANTS, Plant, planted_scene

COURSE = Quantiser(255, Transfer("linear"), "truncate")
NEEDED = 12
"""Of the planted mistakes, to be told first."""


def try_plant(plant: Plant, width: int | None, seed: int) -> dict[str, object]:
    """Plant one mistake and see what it is told as."""
    scene = planted_scene(plant, width)
    levels = plant.levels(scene, seed)
    started = time.perf_counter()
    told = diagnose(scene, [Raw(levels)], COURSE, scene.light_samples, scene.stratify)
    return {
        "planted": plant.name,
        "scene": plant.scene,
        "size": [scene.width, scene.height],
        "samples": scene.light_samples,
        "first": bool(told.mistakes) and told.mistakes[0].name == plant.name,
        "likely_mistakes": told.rows(),
        "difference": told.difference,
        "noise": told.noise,
        "seconds": time.perf_counter() - started,
    }


def main() -> int:
    """Print the table; status 1 where fewer than `NEEDED` are told first."""
    parser = argparse.ArgumentParser(prog="python -m nusselt.experiments.studies.planted_table", description=__doc__)
    parser.add_argument("--width", type=int, help="of the images, instead of the scenes' own")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--json", metavar="FILE|-")
    parser.add_argument("names", nargs="*", help="only these")
    arguments = parser.parse_args()
    chosen = [plant for plant in PLANTS if not arguments.names or plant.name in arguments.names]
    rows = []
    for plant in chosen:
        rows.append(try_plant(plant, arguments.width, arguments.seed))
        console(stderr=True).print(f"{plant.name}: {rows[-1]['seconds']:.1f} s", markup=False)
    if arguments.json:
        write_json(document(rows, seed=arguments.seed), arguments.json)
    table = Table(box=box.SIMPLE, title="Planted in 8-bit images, and what they are told as")
    for name in ("planted", "scene", "first", "second"):
        table.add_column(name)
    for row in rows:
        told = [f"{m['name']} {m['explained']:.1%}" for m in row["likely_mistakes"]] + ["", ""]  # type: ignore[attr-defined]
        table.add_row(str(row["planted"]), str(row["scene"]), told[0], told[1])
    out = console(stderr=arguments.json == "-")
    out.print(table)
    first = sum(bool(row["first"]) for row in rows)
    out.print(f"{first} of {len(rows)} are told first")
    return 0 if first >= min(NEEDED, len(rows)) else 1


if __name__ == "__main__":
    sys.exit(main())
