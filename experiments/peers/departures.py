"""What each setting costs if it is left as it is: renderer x default x size of error."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from nusselt.experiments.external.program import ProgramFailed
from nusselt.experiments.results.schema import Row
from nusselt.experiments.verdict.level import Level

from .arbiter import Arbiter
from .compare import Difference, difference
from .entrant import Effort, of_peer
from .peer import Setting
from .renderer import PeerRenderer


@dataclass(frozen=True)
class Departure:
    """One setting left, on one scene; no difference where the renderer then gave no image, ``failed`` says why."""

    peer: str
    version: str
    setting: Setting
    found: Difference | None
    failed: str = ""

    def row(self, scene: str) -> Row:
        """As `results.json` has it: it claims nothing."""
        what = {"what": self.setting.what, "used": self.setting.used, "left": self.setting.left}
        figures = (
            {}
            if self.found is None
            else {
                "bias_relative": self.found.bias,
                "bias_relative_standard_error": self.found.standard_error,
                "rms_denoised_relative": self.found.rms,
            }
        )
        head = {"experiment": "departures", "scene": scene, "renderer": self.peer, "renderer_version": self.version}
        return head | what | figures | ({"reason": self.failed} if self.failed else {})


def departures(
    renderer: PeerRenderer, arbiter: Arbiter, effort: Effort, margin: float, tell: Callable[[], None] = lambda: None
) -> list[Departure]:
    """Render a scene anew for each setting of a peer, with that setting left."""
    exact, rows = arbiter.exact(), []
    for setting in renderer.peer.settings:
        try:
            entrant = of_peer(renderer, replace(effort, seeds=min(effort.seeds, 2)), tell, setting.options)
            found = difference(arbiter.contestant(entrant), exact, arbiter.shaded, margin, Level())
            rows.append(Departure(renderer.peer.name, entrant.version, setting, found))
        except ProgramFailed as problem:
            rows.append(Departure(renderer.peer.name, renderer.version, setting, None, str(problem)))
    return rows
