"""Images written: whole or not there."""

from __future__ import annotations

from pathlib import Path

from nusselt.experiments.files import replacing
from nusselt.renderer.errors import InputError
from nusselt.renderer.vectors import Floats

from .formats import FORMATS

WRITERS = {kind.suffix: kind.write for kind in FORMATS if kind.write is not None}


def check_image_name(path: Path) -> None:
    """Refuse a name whose format is not written here.

    Raises
    ------
    InputError
    """
    if path.suffix.lower() not in WRITERS:
        raise InputError("output", str(path), "a name that ends in " + ", ".join(WRITERS))


def write_image(path: Path, radiance: Floats) -> None:
    """Write radiance (3, h, w): PNG in the course's eight bits, EXR in float32, NPY (h, w, 3) in float64.

    EXR also takes one channel, (1, h, w).
    """
    check_image_name(path)
    with replacing(path) as beside:
        WRITERS[path.suffix.lower()](beside, radiance)
