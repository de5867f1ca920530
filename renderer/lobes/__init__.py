"""How surfaces reflect: one kind of lobe a file; frozen, validated. See `protocol` to add one."""

from __future__ import annotations

from .lambert import Lambert
from .phong import Phong
from .protocol import Lobe, SampledLobe, ShadingPoints, check_kind

LOBES: tuple[type[Lobe], ...] = (Lambert, Phong)
"""Every kind, once; in the order they are summed."""

for _kind in LOBES:
    check_kind(_kind)

__all__ = ["LOBES", "Lambert", "Lobe", "Phong", "SampledLobe", "ShadingPoints"]
