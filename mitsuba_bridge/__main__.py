"""`python -m nusselt.mitsuba_bridge render SCENE.xml -o IMAGE`: Mitsuba, with the Phong surface registered first."""

from __future__ import annotations

import argparse
import shutil
import sys
from pathlib import Path

import numpy as np

from .llvm import backend
from .process import ReferenceUnavailable
from .reference import ask
from .temporary import temporary_folder


def main() -> int:
    """Render an exported scene with Mitsuba's own film; status 4 if Mitsuba cannot."""
    parser = argparse.ArgumentParser(prog="python -m nusselt.mitsuba_bridge", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    render = commands.add_parser("render", help="render an exported scene")
    render.add_argument("scene", type=Path)
    render.add_argument("-o", "--output", type=Path, required=True, help="IMAGE.exr or IMAGE.npy")
    render.add_argument("--samples", type=int, default=64)
    render.add_argument("--seed", type=int, default=0)
    render.add_argument("--centres", action="store_true", help="rays through the pixels' centres alone, no film")
    arguments = parser.parse_args()
    if not arguments.scene.is_file():
        parser.error(f"scene = {arguments.scene}: expected an XML file")
    if arguments.output.suffix not in (".exr", ".npy"):
        parser.error(f"output = {arguments.output}: expected a name that ends in .exr or .npy")
    job = {
        "task": "image",
        "file": str(arguments.scene.resolve()),
        "output": arguments.output.suffix,
        "samples": arguments.samples,
        "seed": arguments.seed,
        "centres": arguments.centres,
    }
    try:
        with temporary_folder() as folder:
            arrays, _ = ask(job, Path(folder), backend(), 3600.0)
            made = Path(folder) / f"image{arguments.output.suffix}"
            if arguments.output.suffix == ".npy":
                np.save(made, arrays["image"], allow_pickle=False)
            shutil.move(made, arguments.output)
    except ReferenceUnavailable as problem:
        print(f"mitsuba_bridge: {problem}", file=sys.stderr)
        return 4
    return 0


if __name__ == "__main__":
    sys.exit(main())
