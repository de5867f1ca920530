"""usd-core, the one place where it is imported."""

from __future__ import annotations

from pxr import Gf, Tf, Usd, UsdGeom, UsdLux, UsdRender, UsdShade, UsdUtils

__all__ = ["Gf", "Tf", "Usd", "UsdGeom", "UsdLux", "UsdRender", "UsdShade", "UsdUtils"]
