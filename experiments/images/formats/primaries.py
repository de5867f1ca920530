"""Colours of other primaries, brought to those of Rec. 709 by the matrices of both, whites matched as Bradford does."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from nusselt.renderer.vectors import Floats

from .raw import Raw, Rounding

REC709 = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.329)
"""x and y of red, green, blue and white."""
D60 = (0.32168, 0.33767)
SPACES = {
    "lin_rec709_scene": REC709,
    "lin_ap0_scene": (0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.077, *D60),
    "lin_ap1_scene": (0.713, 0.293, 0.165, 0.83, 0.128, 0.044, *D60),
    "lin_p3d65_scene": (0.68, 0.32, 0.265, 0.69, 0.15, 0.06, *REC709[6:]),
    "lin_rec2020_scene": (0.708, 0.292, 0.17, 0.797, 0.131, 0.046, *REC709[6:]),
    "lin_adobergb_scene": (0.64, 0.33, 0.21, 0.71, 0.15, 0.06, *REC709[6:]),
}
"""Linear spaces by the Color Interop Forum's names."""
ALIKE = 2e-3
"""Chromaticities as near as this are the same, written with fewer digits."""
PRECISION = 5e-4
"""Of the pixel's largest channel: whites are written with four digits or five (Mitsuba's X, Y, Z: 3.3e-4 apart)."""
BRADFORD = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])


def usable(chromaticities: Sequence[float]) -> bool:
    """Whether eight numbers are three primaries that span a plane, and a white."""
    values = np.asarray(chromaticities, dtype=np.float64)
    if values.shape != (8,) or not np.isfinite(values).all() or np.abs(values).max() > 10:
        return False
    x, y = values[0:6:2], values[1:6:2]
    area = np.linalg.det(np.array([x, y, np.ones(3)]))
    return bool(abs(area) > 1e-3 and values[7] > 1e-3)


def is_rec709(chromaticities: Sequence[float]) -> bool:
    """Whether eight numbers are Rec. 709's primaries and white, to a few digits."""
    return bool(np.allclose(chromaticities, REC709, rtol=0, atol=ALIKE))


def _xyz_of(x: Floats, y: Floats) -> Floats:
    return np.array([x, y, 1 - x - y])


def _to_xyz(chromaticities: Sequence[float] | Floats) -> Floats:
    """(3, 3) from R, G, B to X, Y, Z; white has Y = 1."""
    values = np.asarray(chromaticities, dtype=np.float64)
    primaries, white = _xyz_of(values[0:6:2], values[1:6:2]), _xyz_of(values[6], values[7]) / values[7]
    return np.asarray(primaries * np.linalg.solve(primaries, white))


def luminance_weights(chromaticities: Sequence[float]) -> Floats:
    """(3,) shares of R, G and B in luminance; they sum to 1."""
    return np.asarray(_to_xyz(chromaticities)[1])


def from_xyz(raw: Raw) -> Raw:
    """CIE X, Y, Z (white is that of Rec. 709) as R, G, B."""
    return _mixed(raw, np.linalg.inv(_to_xyz(REC709)), "its X, Y, Z are taken for CIE's and converted to Rec. 709")


def to_rec709(raw: Raw, chromaticities: Sequence[float], said: str) -> Raw:
    """R, G, B of other primaries as Rec. 709's; ``said`` is where the file names them."""
    from_, to = _to_xyz(chromaticities), _to_xyz(REC709)
    cones = (BRADFORD @ to.sum(axis=1)) / (BRADFORD @ from_.sum(axis=1))
    adapted = np.linalg.solve(BRADFORD, cones[:, None] * BRADFORD)
    listed = ", ".join(f"{v:.4g}" for v in chromaticities)
    note = f"its {said} ({listed}) are not those of Rec. 709: converted, whites matched by Bradford"
    return _mixed(raw, np.linalg.inv(to) @ adapted @ from_, note)


def _mixed(raw: Raw, matrix: Floats, note: str) -> Raw:
    """Channels mixed: each has what the largest is rounded by."""
    values = np.einsum("ij,jyx->iyx", matrix, raw.values)
    relative = PRECISION + float(np.abs(matrix).sum(axis=1).max()) * raw.rounding.relative
    rounding = Rounding(relative, one_exponent=True, lossy=raw.rounding.lossy)
    return replace(raw, values=values, notes=(*raw.notes, note), rounding=rounding)
