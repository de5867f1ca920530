"""A scene's lights switched on and off in one scene of Mitsuba; child only."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mitsuba as mi

from nusselt.mitsuba_bridge.lights import SHAPES

from .own_scene import own_scene
from .scene_dict import scene_dict


class Switches:
    """The scene with all its lights, of which some are on: the others are black, and never sampled.

    The same bits as a scene with these lights alone, and no scene, nor kernel (0.4 to 1.4 s), for each.
    """

    def __init__(self, description: dict[str, Any], folder: Path, own: dict[str, Any] | None = None) -> None:
        self.description, self.own = description, own is not None
        self.all = self.lit = tuple(range(len(description["lights"])))
        if own is not None:
            self.scene = own_scene(own, (description["camera"]["width"], description["camera"]["height"]))
        else:
            self.scene = mi.load_dict(scene_dict(description, folder, self.all))
        self.values = mi.traverse(self.scene) if len(self.all) > 1 else {}
        names = [f"{self._body(k)}.radiance.value" for k in self.all]
        self.radiance = {name: type(self.values[name])(self.values[name]) for name in names if name in self.values}

    def _body(self, number: int) -> str:
        kind = self.description["lights"][number]["kind"]
        return f"light{number}.emitter" if kind in SHAPES else f"light{number}"

    def lighting(self, lit: tuple[int, ...]) -> Any:
        """The scene with these lights on."""
        for number in set(self.lit) ^ set(lit):
            body, on = self._body(number), number in lit
            self.values[f"{body}.sampling_weight"] = float(on)
            radiance = self.radiance.get(f"{body}.radiance.value")
            if radiance is not None:
                self.values[f"{body}.radiance.value"] = radiance if on else type(radiance)(0.0)
        if self.lit != lit:
            self.values.update()
            self.lit = lit
        return self.scene
