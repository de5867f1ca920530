"""Stiff cases, as files bring them: a point, a light, and what it sends there to many digits.

A file is a JSON list of objects, or an object whose ``cases`` is one. Each object has ``kind`` (E: irradiance,
I: modified Phong lobe), ``name``, ``x``, ``n``, ``P``, ``e1``, ``e2``, for a lobe ``w`` and ``s``, and ``oracle``,
a decimal string; ``condition`` and ``note`` may be there. Numbers are taken as exact.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from pathlib import Path
from typing import Any

import numpy as np

from nusselt.renderer.errors import InputError
from nusselt.renderer.vectors import Floats

OWN = Path(__file__).with_name("oracles-stiff.json")
"""The project's own cases, made by `tests/support/make_oracles.py`."""

Vector = tuple[float, float, float]
INPUTS = ("x", "n", "P", "e1", "e2", "w")
"""Vectors of a case."""


@dataclass(frozen=True)
class Case:
    """One case.

    Parameters
    ----------
    kind : {"E", "I"}
    name : str
    x, n, P, e1, e2, w : tuple of three floats
        Point, normal, the light's corner and sides, mirror direction (zero for E).
    s : float
        Phong exponent (0 for E).
    oracle : Decimal
    condition : float or None
        Relative condition number, where the file knows it.
    """

    kind: str
    name: str
    x: Vector
    n: Vector
    P: Vector
    e1: Vector
    e2: Vector
    w: Vector
    s: float
    oracle: Decimal
    condition: float | None = None

    @property
    def height(self) -> float:
        """Of the light's lowest corner over the horizon, relative to the farthest corner's distance."""
        n = np.array(self.n) / np.linalg.norm(self.n)
        corners = self.corners
        farthest = float(np.linalg.norm(corners, axis=0).max())
        return float((n @ corners).min() / farthest) if farthest > 0 else 0.0

    @property
    def corners(self) -> Floats:
        """The light's corners as the point sees them, (3, 4), scaled to a size near 1."""
        x, p, e1, e2 = (np.array(getattr(self, name)) for name in ("x", "P", "e1", "e2"))
        found = np.stack([p - x, p - x + e1, p - x + e1 + e2, p - x + e2], axis=1)
        size = float(np.abs(found).max())
        return found / size if size > 0 else found


def solid_angle(case: Case) -> float:
    """Of the whole light, to a few digits: for figures."""
    v = case.corners
    total = 0.0
    for a, b, c in ((v[:, 0], v[:, 1], v[:, 2]), (v[:, 0], v[:, 2], v[:, 3])):
        la, lb, lc = (float(np.linalg.norm(u)) for u in (a, b, c))
        volume = float(a @ np.cross(b - a, c - a))
        total += 2 * math.atan2(abs(volume), la * lb * lc + (a @ b) * lc + (b @ c) * la + (c @ a) * lb)
    return total


def _number(value: Any, name: str, where: str) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise InputError(name, value, "a finite number", where)
    try:
        found = float(value)
    except OverflowError:
        found = math.inf
    if not math.isfinite(found):
        raise InputError(name, value, "a finite number", where)
    return found


def _vector(entry: dict[str, Any], name: str, where: str, any_length: bool = True) -> Vector:
    value = entry[name]
    if not isinstance(value, list) or len(value) != 3:
        raise InputError(name, value, "three finite numbers", where)
    x, y, z = (_number(component, name, where) for component in value)
    if not any_length and x == y == z == 0:
        raise InputError(name, value, "a vector that is not zero", where)
    return x, y, z


def _oracle(value: Any, where: str) -> Decimal:
    if isinstance(value, bool) or not isinstance(value, (str, int, float)):
        raise InputError("oracle", value, "a number that is not negative, as a decimal string", where)
    try:
        found = Decimal(str(value))
    except InvalidOperation:
        found = Decimal("NaN")
    if not found.is_finite() or found < 0:
        raise InputError("oracle", value, "a number that is not negative, as a decimal string", where)
    return found


def _case(entry: Any, where: str) -> Case:
    if not isinstance(entry, dict):
        raise InputError("case", entry, "an object", where)
    kind = entry.get("kind")
    if kind not in ("E", "I"):
        raise InputError("kind", kind, "E (irradiance) or I (Phong lobe)", where)
    lobe = kind == "I"
    needed = ("name", "x", "n", "P", "e1", "e2", "oracle", *(("w", "s") if lobe else ()))
    for name in needed:
        if name not in entry:
            raise InputError("case", sorted(entry), f"the key {name}", where)
    s = _number(entry["s"], "s", where) if lobe else 0.0
    if s < 0:
        raise InputError("s", s, "an exponent of at least 0", where)
    given = entry.get("condition")
    return Case(
        kind,
        str(entry["name"]),
        _vector(entry, "x", where),
        _vector(entry, "n", where, any_length=False),
        _vector(entry, "P", where),
        _vector(entry, "e1", where),
        _vector(entry, "e2", where),
        _vector(entry, "w", where, any_length=False) if lobe else (0.0, 0.0, 0.0),
        s,
        _oracle(entry["oracle"], where),
        None if given is None else _number(given, "condition", where),
    )


def read_cases(path: Path) -> list[Case]:
    """The cases of a file.

    Raises
    ------
    InputError
        If it cannot be read, or a case is not one.
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError("cases", str(path), f"a file that can be read ({error.strerror})") from error
    except (ValueError, RecursionError) as error:
        raise InputError("cases", str(path), "a JSON file of cases") from error
    entries = content.get("cases") if isinstance(content, dict) else content
    if not isinstance(entries, list) or not entries:
        raise InputError("cases", content, "a list of cases, at least one", str(path))
    found = []
    for number, entry in enumerate(entries, start=1):
        name = f" ({entry['name']})" if isinstance(entry, dict) and "name" in entry else ""
        found.append(_case(entry, f"{path}: case {number}{name}"[:160]))
    return found


def stacked(cases: Sequence[Case], name: str) -> Floats:
    """One vector of every case, (3, n)."""
    return np.array([getattr(case, name) for case in cases], dtype=np.float64).T.reshape(3, -1)
