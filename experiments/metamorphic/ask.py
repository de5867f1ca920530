"""Every relation of a scene put to a renderer: rows."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from nusselt.experiments.check.check import Progress
from nusselt.experiments.check.question import number_within, one_of, whole_within
from nusselt.experiments.check.sequential import LOOKS, share_of, time_of
from nusselt.experiments.external.program import ProgramFailed
from nusselt.experiments.results.schema import Row
from nusselt.experiments.search.examine import stream
from nusselt.experiments.verdict.decision import AS_CLAIMED
from nusselt.experiments.verdict.level import Level
from nusselt.renderer.errors import InputError
from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Floats

from .by_method import judge_by_method, steps_of
from .judge import Judged, judge_relation
from .peer_source import PeerSource
from .relation import Images, Related, Relation, Shot
from .relations import RELATIONS
from .sources import IN_COMMAND, Source

EXPERIMENT = "metamorphic"


@dataclass(frozen=True)
class Asking:
    """How relations are put.

    Parameters
    ----------
    margin : float
        Relative difference declared not to matter, in (0, 1].
    alpha : float
        False-alarm rate of all relations of all scenes together.
    seed : int
    runs : int
        Seeds of a look, 2 to 256.
    budget : float
        Seconds a relation may take until it is decided; 0: one look.
    only : tuple of str
        Names of relations; empty: all.

    Raises
    ------
    InputError
    """

    margin: float = 0.02
    alpha: float = 1e-3
    seed: int = 0
    runs: int = 4
    budget: float = 0.0
    only: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        number_within("margin", self.margin, 0, 1)
        number_within("alpha", self.alpha, 0, 0.5)
        whole_within("runs", self.runs, 2, 256)
        for name in self.only:
            one_of("relation", name, tuple(relation.name for relation in RELATIONS))


def relations_of(scene: Scene, source: Source, asking: Asking) -> list[tuple[Relation, Related | str]]:
    """All relations, those that a scene has and, for the others, why it has not."""
    asked = (relation for relation in RELATIONS if not asking.only or relation.name in asking.only)
    return [(relation, related_of(relation, scene, source, asking)) for relation in asked]


def related_of(relation: Relation, scene: Scene, source: Source, asking: Asking) -> Related | str:
    """A relation of a scene; or why it has none."""
    if missing := [kind for kind in relation.kinds if kind not in source.knows]:
        return _unknown(missing[0], source)
    try:
        related = relation.make(scene, stream(asking.seed, relation.name))
    except InputError as error:
        return f"no valid scene: {error}"
    return related if isinstance(related, str) else _shown(related, source)


def _unknown(kind: str, source: Source) -> str:
    """Why nothing is asked that needs a kind of light, seeds or threads."""
    if isinstance(source, PeerSource):
        return f"{source.peer.title} has no {kind}" if kind in IN_COMMAND else f"peers are not given a {kind} light"
    return f"{{{kind}}} is not in the command" if kind in IN_COMMAND else "--new-kinds was not said"


def _shown(related: Related, source: Source) -> Related | str:
    """Or why a peer cannot show one of its scenes."""
    if not isinstance(source, PeerSource):
        return related
    return next(filter(None, (source.refusal(shot.scene) for shot in related.shots)), related)


@dataclass
class Pictures:
    """Images of one scene and its shots; the scene's own are kept."""

    scene: Scene
    source: Source
    kept: dict[int, Floats] = field(default_factory=dict)

    def of(self, related: Related, seed: int) -> Images:
        """The scene's image, then every shot's."""
        if seed not in self.kept:
            self.kept[seed] = self.source.image(Shot(self.scene), seed)
        return [self.kept[seed], *(self.source.image(shot, seed) for shot in related.shots)]


def is_still(related: Related, source: Source) -> bool:
    """Whether images of a relation are claimed to have no noise: all of them, for other lights may come in."""
    scenes = (related.of, *(shot.scene for shot in related.shots))
    return related.still or all(source.claim(scene) == "exact" for scene in scenes)


def put(pictures: Pictures, related: Related, asking: Asking, level: Level) -> tuple[Judged, int, int]:
    """Judge a relation: the verdict, its seeds, and how often it was looked at; until it is decided, if there is time.

    Looks spend from one false-alarm rate, as those of `check --until-decided` do.
    """
    if steps := steps_of(pictures.source, [Shot(related.of), *related.shots]):
        one = pictures.of(related, asking.seed + 1)
        return judge_by_method(related, one, steps, level, asking.margin), 1, 1
    started, images, look = time.monotonic(), [], 0  # type: ignore[var-annotated]
    related = replace(related, still=is_still(related, pictures.source))
    while True:
        look += 1
        for _ in range(math.ceil(asking.runs * share_of(look))):
            try:
                images.append(pictures.of(related, asking.seed + 1 + len(images)))
            except ProgramFailed as problem:
                if not pictures.kept:
                    raise
                return Judged("differs", f"no image: {problem}", {}), len(images), look
        now = level.at_time(time_of(look)) if asking.budget else level
        judged = judge_relation(related, images, now, asking.margin, pictures.source.rounding)
        spent = time.monotonic() - started
        late = spent * (1 + share_of(look + 1) / time_of(look)) > asking.budget
        if judged.word != "undecided" or judged.more is None or late or look == LOOKS:
            return judged, len(images), look


def ask(
    scenes: Sequence[Scene],
    source: Source,
    asking: Asking,
    command: Callable[[Scene, Relation], str] = lambda scene, relation: "",
    progress: Progress | None = None,
) -> list[Row]:
    """Rows of all relations of all scenes; those that a scene does not have claim nothing and say why.

    Raises
    ------
    InputError
        For a scene with textures, or one that a peer cannot show.
    ProgramFailed
        If a program gives no image of a scene itself.
    """
    for scene in scenes:
        scene.refuse_textures("what is rendered beside it")
        if isinstance(source, PeerSource) and (why := source.refusal(scene)):
            raise InputError("scene", scene.name, f"one that the renderer can show: {why}")
    made = [(scene, *one) for scene in scenes for one in relations_of(scene, source, asking)]
    level = Level(asking.alpha, max(1, sum(isinstance(related, Related) for _, _, related in made)))
    rows: list[Row] = []
    pictures = Pictures(scenes[0], source)
    for number, (scene, relation, related) in enumerate(made):
        if progress:
            progress(f"{scene.name}: {relation.name}", number, len(made))
        if scene is not pictures.scene:
            pictures = Pictures(scene, source)
        row = _head(scene, source, relation, asking) | {"command": command(scene, relation)}
        if isinstance(related, str):
            rows.append(row | {"reason": related})
            continue
        started = time.perf_counter()
        judged, passes, looks = put(pictures, related, asking, level)
        said: dict[str, Any] = {"verdict": judged.word, "as_claimed": _as_claimed(judged, source, scene)}
        said |= {"reason": judged.reason, "passes": passes, "looks": looks, **judged.figures}
        rows.append(row | said | {"seconds": time.perf_counter() - started})
    return rows


def _as_claimed(judged: Judged, source: Source, scene: Scene) -> bool | None:
    """What is claimed to be biased may differ."""
    if judged.word == "differs" and source.claim(scene) in ("biased", "consistent"):
        return True
    return AS_CLAIMED[judged.word]


def _head(scene: Scene, source: Source, relation: Relation, asking: Asking) -> Row:
    return {
        "experiment": EXPERIMENT,
        "scene": scene.name,
        "method": relation.name,
        "estimator": source.name,
        "expects": relation.expects,
        "likely": relation.likely,
        "samples": scene.light_samples,
        "stratified": scene.stratify,
        "margin": asking.margin,
        "seed": asking.seed,
    }
