"""Images written: whole or not there."""

from __future__ import annotations

from pathlib import Path

from nusselt.experiments.files import replacing
from nusselt.renderer.errors import InputError
from nusselt.renderer.vectors import Floats

from .formats import FORMATS

WRITERS = {kind.suffix: kind.write for kind in FORMATS if kind.write is not None}
WIDE = {kind.suffix: kind.write_wide for kind in FORMATS if kind.write_wide is not None}


def check_image_name(path: Path, bits: int | None = None) -> None:
    """Refuse a name whose format is not written here, or not with so many bits.

    Raises
    ------
    InputError
    """
    if path.suffix.lower() not in WRITERS:
        raise InputError("output", str(path), "a name that ends in " + ", ".join(WRITERS))
    if bits not in (None, 8, 16):
        raise InputError("bits", bits, "8 or 16")
    if bits and path.suffix.lower() not in WIDE:
        raise InputError("bits", bits, "it left out: only " + ", ".join(WIDE) + " has levels")


def write_image(path: Path, radiance: Floats, bits: int | None = None) -> None:
    """Write radiance (3, h, w): PNG in the course's eight bits or in 16, EXR in float32, NPY (h, w, 3) in float64.

    EXR also takes one channel, (1, h, w).
    """
    check_image_name(path, bits)
    with replacing(path) as beside:
        (WIDE if bits == 16 else WRITERS)[path.suffix.lower()](beside, radiance)
