"""The smallest scene that still fails in the same way: fewer things, rounder numbers, a few pixels about the worst."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from nusselt.renderer.errors import InputError
from nusselt.renderer.lights.text import vector_fields
from nusselt.renderer.scene import Scene
from nusselt.renderer.scene_text import write_scene
from nusselt.renderer.surfaces import Ellipsoid, Material, Mesh

from .examine import EXACT, ITSELF, Fault, examine
from .judge import seen
from .referees import REFEREES
from .twins import TWINS

SECONDS = 15.0
"""Processor time for one scene."""
PIXELS = 8
SHARE = 0.1
"""How much of the first difference must be left: a fault must not give way to another."""
ASKED = 16
"""Points a referee is asked about, where it is the one who disagrees."""

Fails = Callable[[Scene], Fault | None]


def failing(fault: Fault, seed: int, estimator: Any = EXACT) -> Fails:
    """Whether a scene has the fault: the same check fails, in the same manner."""
    twins = [twin for twin in TWINS if twin.name == fault.check]
    referees = [name for name in REFEREES if name == fault.check]
    manner = fault.what.split(":")[0] if fault.pixel < 0 or fault.check == ITSELF else ""

    def fails(scene: Scene) -> Fault | None:
        try:
            found = examine(scene, seed, twins, referees, estimator, points=ASKED).faults
        except InputError:
            return None
        alike = [f for f in found if f.check == fault.check and f.what.startswith(manner)]
        alike = [f for f in alike if (f.pixel < 0) == (fault.pixel < 0) and f.difference >= SHARE * fault.difference]
        return max(alike, key=lambda f: f.difference, default=None)

    return fails


def shrunk(
    scene: Scene, fault: Fault, seed: int, estimator: Any = EXACT, seconds: float = SECONDS
) -> tuple[Scene, Fault]:
    """A smaller scene with the same fault, and the fault as it is there; as they are if it is not found again."""
    fails, until = failing(fault, seed, estimator), time.process_time() + seconds
    for changes in (_nearer, _fewer, simpler, _fewer_triangles, _rounder):
        done = False
        while not done:
            done = True
            for candidate in changes(scene, fault):
                if time.process_time() > until:
                    return scene, fault
                if (left := fails(candidate)) is not None:
                    scene, fault, done = candidate, left, changes in (_nearer, _rounder)
                    break
    return scene, fault


def _made(make: Callable[[], Scene]) -> Iterator[Scene]:
    """The scene, if it is valid."""
    try:
        yield make()
    except InputError:
        return


def _nearer(scene: Scene, fault: Fault) -> Iterator[Scene]:
    """Few pixels, the worst one's point in their middle."""
    if fault.pixel < 0:
        return
    one = seen(scene)
    place = one.view.hits.position[:, fault.pixel] + one.anchor
    for shrink in (3.0, 1.0):
        camera = replace(scene.camera, target=tuple(place), fov_y=scene.camera.fov_y / shrink)
        yield from _made(lambda camera=camera: scene.with_(camera=camera, width=PIXELS, height=PIXELS))  # type: ignore[misc]


def _fewer(scene: Scene, fault: Fault) -> Iterator[Scene]:
    """Without one thing."""
    for name in ("lights", "meshes", "ellipsoids"):
        things = getattr(scene, name)
        for k in range(len(things)):
            yield scene.with_(**{name: things[:k] + things[k + 1 :]})


def _fewer_triangles(scene: Scene, fault: Fault) -> Iterator[Scene]:
    """Without one triangle."""
    for k, mesh in enumerate(scene.meshes):
        for t in range(mesh.triangles.shape[1]):
            fewer = Mesh(mesh.vertices, np.delete(mesh.triangles, t, axis=1), mesh.material)
            if fewer.triangles.size:
                yield scene.with_(meshes=(*scene.meshes[:k], fewer, *scene.meshes[k + 1 :]))


def simpler(scene: Scene, fault: Fault | None = None) -> Iterator[Scene]:
    """Plain surfaces and lights; each only where it changes something."""
    grey = Material((0.5, 0.5, 0.5))
    plain = scene.with_(
        meshes=tuple(Mesh(mesh.vertices, mesh.triangles, grey) for mesh in scene.meshes),
        ellipsoids=tuple(replace(one, material=grey) for one in scene.ellipsoids),
    )
    white = tuple(v.with_colour((1.0, 1.0, 1.0)) if v.area > 0 else v for v in scene.lights)
    for candidate in (scene.with_(two_sided=False), plain, scene.with_(lights=white)):
        if candidate != scene:
            yield candidate


def _rounder(scene: Scene, fault: Fault) -> Iterator[Scene]:
    """All numbers with few decimals, the fewest first."""
    for digits in (0, 1, 2, 3, 4, 6):
        yield from _made(lambda digits=digits: rounded(scene, digits))  # type: ignore[misc]


def rounded(scene: Scene, digits: int) -> Scene:
    """With so many decimals in every coordinate."""

    def at(p: Any) -> Any:
        return tuple(np.round(np.array(p), digits).tolist())

    def lit(light: Any) -> Any:
        return replace(light, **{name: at(getattr(light, name)) for name in vector_fields(light)})

    camera = scene.camera
    return scene.with_(
        camera=replace(camera, position=at(camera.position), target=at(camera.target), up=at(camera.up)),
        meshes=tuple(Mesh(np.round(m.vertices, digits), m.triangles, m.material) for m in scene.meshes),
        ellipsoids=tuple(Ellipsoid(at(e.center), tuple(map(at, e.axes)), e.material) for e in scene.ellipsoids),
        lights=tuple(map(lit, scene.lights)),
    )


def told(scene: Scene, faults: list[Fault], command: str) -> str:
    """The scene as text, after what is wrong with it."""
    lines = [f"# {scene.name}: {fault.check}: {fault.what}" for fault in faults]
    lines += [
        f"# pixel {f.pixel}, off by {f.difference:.3g} of the unoccluded value, {f.ratio:.3g} times what is allowed; "
        f"{f.points} points"
        for f in faults
        if f.pixel >= 0
    ]
    return "\n".join([*lines, f"# {command}", "", write_scene(scene)])
