#!/usr/bin/env bash
# eulumdat-ies: two lamps make a luminaire twice as bright, an LED's absolute file loses its flux, a foot becomes 305 metres.
#
# Guess: candelas of the IES file are the LDT's cd/klm times the total flux of its lamps over 1000 lm, also where -1 lamps say
# that the photometry is absolute; openings are the same length in both, in feet or in metres.
# Seen: the flux, which EULUMDAT defines as that of all the lamps of a set, is multiplied by their number: twice the candelas
# for two lamps. With -1 lamps the candelas are the cd/klm themselves: 3000 lm are taken for 1000. From IES to LDT, an opening
# of 2 feet becomes one of 610 metres; one of .6 metres, 600 mm.
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install -q --disable-pip-version-check "eulumdat-ies==1.1.0" "eulumdat-py==1.0.0"
"$place/venv/bin/python" - "$place" <<'PY'
import sys
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path

from eulumdat_ies import ies_to_ldt, ldt_to_ies
from pyldt import LdtReader, LdtWriter

print("eulumdat-ies", version("eulumdat-ies"), "eulumdat-py", version("eulumdat-py"))
place = Path(sys.argv[1])


def ies(units, width):
    """1000 cd downwards of one lamp of 1000 lm, an opening of so many feet (1) or metres (2) a side."""
    lines = ["IESNA:LM-63-2002", "[TEST] none", "[MANUFAC] none", "TILT=NONE", f"1 1000 1 3 1 1 {units} {width} {width} 0"]
    (place / "a.ies").write_text("\n".join([*lines, "1 1 100", "0 45 90", "0", "1000 500 0"]) + "\n")
    return ies_to_ldt(place / "a.ies")


def candelas(lamps, flux):
    """Downwards in the IES file that is made of an LDT file with 1000 cd/klm downwards."""
    ldt = ies(2, 0.6)
    ldt.header = replace(ldt.header, num_lamps=[lamps], lamp_flux=[flux])
    LdtWriter.write(ldt, place / "a.ldt", overwrite=True)
    words = ldt_to_ies(LdtReader.read(place / "a.ldt")).split("TILT=NONE")[1].split()
    first = 13 + int(words[3]) + int(words[4])
    return float(words[first]) * float(words[2]) * float(words[10])


def opening(units, width):
    return ies(units, width).header.width_lum_area


seen = {
    "1 lamp, 3000 lm in all: 3000 cd": (candelas(1, 3000.0), 3000.0),
    "2 lamps, 3000 lm in all: 3000 cd": (candelas(2, 3000.0), 6000.0),
    "-1 lamps (absolute), 3000 lm: 3000 cd": (candelas(-1, 3000.0), 1000.0),
    "an opening of .6 m: 600 mm": (opening(2, 0.6), 600.0),
    "an opening of 2 feet: 610 mm": (opening(1, 2), 609600.0),
}
for what, (value, _) in seen.items():
    print(f"{what:38} made of it: {value:g}")
if any(abs(value - expected) > 1e-3 * expected for value, expected in seen.values()):
    raise SystemExit("changed")
PY
