"""`nusselt.metamorphic`: `nusselt metamorphic` as a call."""

from __future__ import annotations

from collections.abc import Sequence

from nusselt.experiments.check.request import Reading, SceneLike
from nusselt.experiments.external.function import RenderFunction
from nusselt.experiments.metamorphic.ask import Asking, ask
from nusselt.experiments.metamorphic.sources import EstimatorSource, RendererSource, Source, renderer_source, sized
from nusselt.experiments.results.schema import Row

from .arguments import known_arguments


@known_arguments
def metamorphic(
    *scenes: SceneLike,
    renderer: str | RenderFunction | None = None,
    estimator: str | None = None,
    width: int | None = None,
    samples: int | None = None,
    margin: float = 0.02,
    alpha: float = 1e-3,
    seed: int = 0,
    runs: int = 4,
    budget: float = 0.0,
    only: Sequence[str] = (),
    new_kinds: bool = False,
    exact: bool = False,
    image_type: str = ".exr",
    run_timeout: float = 600.0,
) -> list[Row]:
    """Put what right images keep to a renderer, or to an estimator of ours: a row a relation, no reference.

    Parameters
    ----------
    *scenes : str, path, dict or Scene
    renderer : callable or str, optional
        ``f(scene, samples, seed)`` to an array (h, w, 3), a command with {output}, or "mitsuba".
    estimator : str, optional
    width, samples : int, optional
        Instead of the scenes'.
    margin, alpha, seed, runs, budget, only
        As in `nusselt.experiments.metamorphic.ask.Asking`.
    new_kinds, exact, image_type, run_timeout
        Of the renderer, as the command has them.

    Raises
    ------
    InputError
    ProgramFailed
        If a command gives no image of a scene itself.
    """
    asking = Asking(margin, alpha, seed, runs, budget, tuple(only))
    source: Source = EstimatorSource(estimator)
    if isinstance(renderer, str):
        source = renderer_source(renderer, image_type, run_timeout, new_kinds, exact)
    elif renderer is not None:
        source = RendererSource(renderer, new_kinds, exact)
    read = [sized(Reading().scene(scene), width, samples) for scene in scenes]
    return ask(read, source, asking)
