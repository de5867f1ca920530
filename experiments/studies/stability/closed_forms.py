"""Rows of stiff cases: the closed forms in double and single precision, the textbook, and Mitsuba beside them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from decimal import Decimal, localcontext
from typing import Any

import numpy as np

from nusselt.experiments.results.schema import Row
from nusselt.experiments.runs.experiment import Outcome
from nusselt.experiments.studies.stability.cases import INPUTS, Case, solid_angle
from nusselt.experiments.studies.stability.forms import conditions, evaluate
from nusselt.experiments.studies.stability.textbook import textbook_values
from nusselt.mitsuba_bridge.patch_irradiance import irradiance_by_mitsuba
from nusselt.mitsuba_bridge.reference import ReferenceUnavailable

DTYPES: tuple[Any, ...] = (np.float64, np.float32)


def relative_error(value: float, oracle: Decimal) -> float | None:
    """|value - oracle| / oracle, to every digit of the oracle; None where that is no finite number."""
    if not math.isfinite(value):
        return None
    with localcontext() as exactly:
        exactly.prec = 60
        error = abs(Decimal(value) - oracle)
        if error == 0:
            return 0.0
        found = float(error / oracle) if oracle else math.inf
    return found if math.isfinite(found) else None


def held(value: float, bound: float, oracle: Decimal) -> bool:
    """Whether |value - oracle| <= bound |oracle|; a bound of 1 or more claims nothing, but must be said."""
    if not math.isfinite(value) or not math.isfinite(bound):
        return False
    with localcontext() as exactly:
        exactly.prec = 60
        return abs(Decimal(value) - oracle) <= Decimal(bound) * max(oracle, abs(Decimal(value)))


def mitsuba_errors(cases: Sequence[Case], seed: int) -> tuple[list[float | None], str]:
    """Signed relative error of Mitsuba for each case, None where it has none; and why, where it was not asked."""
    asked = [index for index, case in enumerate(cases) if case.kind == "E"]
    found: list[float | None] = [None] * len(cases)
    if not asked:
        return found, ""
    told = [{name: list(getattr(cases[index], name)) for name in INPUTS[:5]} for index in asked]
    try:
        means, _ = irradiance_by_mitsuba(told, seed)
    except ReferenceUnavailable as problem:
        return found, str(problem)
    for index, mean in zip(asked, means, strict=True):
        oracle = float(cases[index].oracle)
        if math.isfinite(mean) and (oracle > 0 or mean == 0):
            found[index] = (mean - oracle) / oracle if oracle > 0 else 0.0
    return found, ""


def case_rows(cases: Sequence[Case], seed: int, ask: bool = True) -> Outcome:
    """Two rows a case. ``ask``: whether Mitsuba is asked too."""
    theirs, missing = mitsuba_errors(cases, seed) if ask else ([None] * len(cases), "not asked")
    rows: dict[tuple[int, int], Row] = {}
    for kind in ("E", "I"):
        index = [number for number, case in enumerate(cases) if case.kind == kind]
        some = [cases[number] for number in index]
        if not some:
            continue
        known = conditions(some)
        for position, dtype in enumerate(DTYPES):
            values, bounds, forms = evaluate(some, dtype)
            textbook = textbook_values(some, dtype)
            for k, case in enumerate(some):
                answer = float(values[k]), float(bounds[k])
                row = _row(case, np.dtype(dtype).name, forms[k], *answer, known[k], textbook[k])
                rows[index[k], position] = row | {"mitsuba": theirs[index[k]]}
    ordered = [rows[place] for place in sorted(rows)]
    shape = {name: np.repeat([getattr(case, name) for case in cases], 2) for name in ("s", "height")}
    shape["solid_angle"] = np.repeat([solid_angle(case) for case in cases], 2)
    return Outcome(ordered, {**shape, "asked": np.array(0.0 if missing else 1.0)})


def _row(
    case: Case, dtype: str, form: str, value: float, bound: float, condition: float | None, textbook: float | None
) -> Row:
    right = held(value, bound, case.oracle)
    return {
        "name": case.name,
        "kind": case.kind,
        "dtype": dtype,
        "form": form,
        "value": value,
        "error_bound": bound,
        "oracle": str(case.oracle),
        "relative_error": relative_error(value, case.oracle),
        "bound_held": right,
        "condition": condition,
        "textbook_error": None if textbook is None else relative_error(textbook, case.oracle),
    }
