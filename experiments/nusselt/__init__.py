"""Is a direct-lighting renderer right, and how sure are we?

``check`` judges our renderer, an estimator, images or somebody's renderer; ``render`` makes our image alone. What is
named here is imported when it is first asked for: ``import nusselt`` and ``nusselt.renderer`` wait for NumPy at most.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from nusselt.experiments.front.answers import Results
    from nusselt.experiments.front.check import check
    from nusselt.experiments.front.metamorphic import metamorphic
    from nusselt.experiments.front.render import Picture, read_scene, render
    from nusselt.experiments.results.compare import compare
    from nusselt.experiments.results.report import write_report
    from nusselt.renderer.errors import InputError

_HOMES = {
    "check": "experiments.front.check",
    "metamorphic": "experiments.front.metamorphic",
    "render": "experiments.front.render",
    "read_scene": "experiments.front.render",
    "compare": "experiments.results.compare",
    "write_report": "experiments.results.report",
    "Results": "experiments.front.answers",
    "Picture": "experiments.front.render",
    "InputError": "renderer.errors",
}
"""Where each name lives, below this package."""

__all__ = [
    "InputError",
    "Picture",
    "Results",
    "check",
    "compare",
    "metamorphic",
    "read_scene",
    "render",
    "write_report",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found = getattr(import_module(f".{_HOMES[name]}", __name__), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOMES})
