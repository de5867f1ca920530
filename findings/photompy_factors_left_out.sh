#!/usr/bin/env bash
# photompy: the ballast factor and the TILT factors of an IES file change nothing, and an LDT made of it is as bright without.
#
# Guess: candelas of a file are its numbers times the multiplier, the ballast factor and the factors of TILT, as LM-63 has it;
# so are intensity and flux that are read from it, and what is made of it in another format.
# Seen: the multiplier is heeded, the others are kept as they are: with a ballast factor of .5, or TILT factors of .5,
# a lamp of 1000 cd and 3139 lm stays one, where Radiance's ies2rad makes 500 cd of it. The LDT file that is made of it, which
# has no such factor, is of 3139 lm too.
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install -q --disable-pip-version-check "photompy==0.3.1" "pyradiance==1.3.1" "numpy==2.4.6"
cd "$place"
venv/bin/python - <<'PY'
import os
import subprocess
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pyradiance
from photompy import IESFile, LDTFile

print("photompy", version("photompy"), "pyradiance", version("pyradiance"))
home = Path(pyradiance.__file__).parent
os.environ["RAYPATH"], os.environ["PATH"] = f"{home / 'lib'}{os.pathsep}.", f"{home / 'bin'}{os.pathsep}{os.environ['PATH']}"
angles = np.arange(0, 91, 5)
candelas = 1000 * np.cos(np.radians(angles))


def numbers(values):
    return " ".join(f"{value:.6g}" for value in values)


def write(multiplier, ballast, tilt):
    factors = ["TILT=NONE"] if tilt == 1 else ["TILT=INCLUDE", "1", "3", "0 45 90", numbers([tilt] * 3)]
    lamp = [f"1 1000 {multiplier} {angles.size} 1 1 2 0 0 0", f"{ballast} 1 100", numbers(angles), "0", numbers(candelas)]
    Path("a.ies").write_text("\n".join(["IESNA:LM-63-2002", "[TEST] none", "[MANUFAC] none", *factors, *lamp]) + "\n")


def by_radiance():
    """Candelas downwards, by the irradiance 10 m below."""
    subprocess.run("ies2rad -dm -o a a.ies 2> log && oconv a.rad > a.oct", shell=True, check=True)
    words = "rtrace -h -I -ab 0 -ds 0 -dj 0 -dt 0 -dc 1 -av 0 0 0 a.oct".split()
    traced = subprocess.run(words, input="0 0 -10 0 0 1\n", capture_output=True, text=True, check=True)
    return float(np.dot([float(word) for word in traced.stdout.split()], [0.265, 0.670, 0.065])) * 179 * 10**2


changed = False
for what, factors in {"as it is": (1, 1, 1), "multiplier 2": (2, 1, 1), "ballast .5": (1, 0.5, 1), "TILT .5": (1, 1, 0.5)}.items():
    write(*factors)
    photometry = IESFile.read("a.ies").photometry
    LDTFile.from_photometry(photometry, manufacturer="none", luminaire_name="none").write("a.ldt")
    read = [photometry.get_intensity(0, 0), photometry.total_optical_power(), LDTFile.read("a.ldt").photometry.total_optical_power()]
    radiance = by_radiance()
    print(f"{what:12} photompy: {float(read[0]):.0f} cd, {read[1]:.0f} lm, as LDT {read[2]:.0f} lm; Radiance: {radiance:.0f} cd")
    expected = factors[0] * np.array([1000, 3141.6, 3141.6])
    changed |= not np.allclose(read, expected, rtol=0.01) or abs(radiance / (1000 * np.prod(factors)) - 1) > 0.01
if changed:
    raise SystemExit("changed")
PY
