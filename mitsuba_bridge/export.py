"""The equivalent Mitsuba scene as files: XML, and a PLY for every mesh."""

from __future__ import annotations

import os
import shutil
import tempfile
from pathlib import Path

from nusselt.renderer.errors import InputError
from nusselt.renderer.scene import Scene

from .description import describe
from .lights import EMITTERS
from .xml import to_xml


def export_scene(scene: Scene, target: Path) -> list[str]:
    """Write ``target`` (.xml) and its meshes beside it; all or nothing.

    Returns
    -------
    list of str
        What is to be said of the files, in plain sentences.

    Raises
    ------
    InputError
        If the name does not end in .xml, or the folder cannot be written to.
    """
    if target.suffix.lower() != ".xml":
        raise InputError("output", str(target), "a name that ends in .xml")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        beside = Path(tempfile.mkdtemp(prefix=f".{target.stem}-", dir=target.parent))
    except OSError as error:
        raise InputError("output", str(target), f"a place that can be written to ({error.strerror})") from error
    try:
        description = describe(scene, beside, stem=target.stem)
        (beside / target.name).write_text(to_xml(description), encoding="utf-8")
        for path in sorted(beside.iterdir(), key=lambda p: p.suffix == ".xml"):  # the XML last: it names the rest
            os.replace(path, target.parent / path.name)
    except OSError as error:
        raise InputError("output", str(target), f"a place that can be written to ({error.strerror})") from error
    finally:
        shutil.rmtree(beside, ignore_errors=True)
    notes = list(description.notes)
    strange = ["glossy surfaces"] * description.is_glossy
    if any(light["kind"] in EMITTERS for light in description.lights):
        strange.append("cosine lights")
    if strange:
        notes.append(
            f"the scene has {' and '.join(strange)}, which the stock mitsuba executable does not know: "
            f"render it with `python -m nusselt.mitsuba_bridge render {target.name} -o IMAGE.exr`"
        )
    if any(max(shape["emission"]) > 0 for shape in description.shapes):
        notes.append("emission of ordinary surfaces is not in the file: it is seen, but lights nothing")
    notes.append(f"lengths in the file are {description.scale:g} times the scene's, moved by {description.centre}")
    return notes
