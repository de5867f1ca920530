"""Which estimator: a user's, by the name it is imported under; or the one without noise in a scene."""

from __future__ import annotations

import importlib
import os
import re
import sys
from typing import Any

from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import ESTIMATORS, Estimator
from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene import Scene

PATH = re.compile(r"[A-Za-z_]\w*(\.[A-Za-z_]\w*)*:[A-Za-z_]\w*")
ACCEPTED = "package.module:Name, a class as in renderer/estimators/protocol.py"
MEMBERS = ("name", "summary", "shares_points", "claim", "is_random", "__call__")


def is_path(name: str) -> bool:
    """Whether an estimator's name is an import path rather than one of ours."""
    return ":" in name


def imported_estimator(path: str) -> type[Estimator]:
    """The estimator class at ``package.module:Name``; the current folder is looked in too.

    Raises
    ------
    InputError
        If it is no such path, cannot be imported, or is no estimator.
    """
    if not PATH.fullmatch(path):
        raise InputError("estimator", path, ACCEPTED)
    module_name, _, name = path.partition(":")
    here = os.getcwd()
    if here not in sys.path:
        sys.path.append(here)  # after the installed packages: nothing of theirs is hidden
    try:
        module = importlib.import_module(module_name)
    except Exception as error:
        told = f"a module that can be imported ({type(error).__name__}: {error})"
        raise InputError("estimator", path, told[:200]) from error
    kind: Any = getattr(module, name, None)
    if not isinstance(kind, type):
        raise InputError("estimator", path, f"a class of that name in {module_name}")
    check_members(kind, path)
    return kind


def check_members(kind: type, said: str) -> None:
    """Refuse a class that is no estimator; ``said`` is what the user calls it.

    Raises
    ------
    InputError
    """
    missing = [member for member in MEMBERS if not hasattr(kind, member)]
    if missing:
        raise InputError("estimator", said, f"a class with {', '.join(MEMBERS)}; it has no {missing[0]}")


def path_of(kind: type) -> str:
    """What `imported_estimator` finds a class by."""
    return f"{kind.__module__}:{kind.__qualname__}"


def told_name(estimator: Estimator) -> str:
    """An estimator's name; where somebody's class goes by one of ours, what it is imported by."""
    kind = type(estimator)
    taken = kind not in ESTIMATORS and any(kind.name == ours.name for ours in ESTIMATORS)
    return path_of(kind) if taken else estimator.name


def estimator_at(path: str, samples: int, stratified: bool) -> Estimator:
    """The estimator at a path with N samples per light.

    Raises
    ------
    InputError
    """
    return _made(imported_estimator(path), path, samples, stratified)


def estimator_of(kind: type[Estimator], samples: int, stratified: bool) -> Estimator:
    """An estimator of a class with N samples per light.

    Raises
    ------
    InputError
        If it is no estimator.
    """
    check_members(kind, path_of(kind))
    return _made(kind, path_of(kind), samples, stratified)


def _made(kind: type[Estimator], said: str, samples: int, stratified: bool) -> Estimator:
    try:
        return kind(samples=samples, stratified=stratified)
    except InputError:
        raise
    except Exception as error:
        told = f"a class that takes samples and stratified ({type(error).__name__}: {error})"
        raise InputError("estimator", said, told[:200]) from error


def noise_free(scene: Scene) -> Estimator | None:
    """The first estimator that claims this scene exactly and draws no random number; None where none does."""
    needs = prepare(scene).needs
    exact = (made for made in (kind() for kind in ESTIMATORS) if made.claim(needs) == "exact")
    return next((made for made in exact if not made.is_random(needs)), None)
