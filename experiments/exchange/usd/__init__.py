"""USD scenes: read by usd-core, where it is installed; written as text without it."""

from __future__ import annotations

from pathlib import Path

from nusselt.renderer.errors import InputError
from nusselt.renderer.scene import Scene

from .write import usd_text

__all__ = ["read_usd", "usd_text"]


def read_usd(path: Path, *, as_diffuse: bool = False) -> Scene:
    """Read a USD file.

    Parameters
    ----------
    path : Path
    as_diffuse : bool
        Take the diffuse colour of surfaces that are none, with a warning each.

    Raises
    ------
    InputError
        If usd-core is not installed or cannot open it, or for what is no direct lighting of our kinds, by prim.
    """
    try:
        from .stage import scene_of
    except ImportError:
        accepted = "the package usd-core, which reads USD: pip install 'nusselt[usd]'"
        raise InputError("scene", path.name, accepted, str(path)) from None
    return scene_of(path, as_diffuse)
