"""A lamp without extent of intensity I max(cos, 0) about its normal, as a Mitsuba emitter; nothing it ships is equal.

Imported in the child only, after the variant is set.
"""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi

NAME = "cosine_point"


def register() -> type:
    """Make the lamp known to the current variant; returns its class."""

    class CosinePoint(mi.Emitter):
        def __init__(self, props: Any) -> None:
            super().__init__(props)
            self.position = mi.ScalarPoint3f(props["position"])
            self.normal = mi.ScalarVector3f(dr.normalize(mi.ScalarVector3f(props["normal"])))
            self.intensity = props.get_emissive_texture("intensity", 1.0)
            self.m_flags = mi.EmitterFlags.DeltaPosition
            self.m_needs_sample_3 = False

        def sample_direction(self, it: Any, sample: Any, active: Any = True) -> Any:
            ds: Any = mi.DirectionSample3f()  # not dr.zeros, which the scalar variants lack here
            ds.p, ds.n = self.position, mi.Normal3f(self.normal)
            ds.uv, ds.time = mi.Point2f(0.5), it.time
            ds.pdf, ds.delta = 1.0, True
            ds.emitter = getattr(mi, "EmitterPtr", lambda emitter: emitter)(self)  # scalar variants point at objects
            ds.d = ds.p - it.p
            square = dr.squared_norm(ds.d)
            ds.dist = dr.sqrt(square)
            ds.d /= ds.dist
            fall = dr.maximum(-dr.dot(ds.d, ds.n), 0) / square
            si: Any = mi.SurfaceInteraction3f()
            si.wavelengths = it.wavelengths
            return ds, dr.select(active, self.intensity.eval(si, active) * fall, 0)

        def pdf_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
            return mi.Float(0)

        def eval_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
            return mi.Color3f(0)

        def eval(self, si: Any, active: Any = True) -> Any:
            return mi.Color3f(0)

        def bbox(self) -> Any:
            return mi.ScalarBoundingBox3f(self.position, self.position)

        def traverse(self, callback: Any) -> None:
            super().traverse(callback)
            callback.put("intensity", self.intensity, mi.ParamFlags.Differentiable)

        def to_string(self) -> str:
            return f"CosinePoint[position={self.position}, normal={self.normal}, intensity={self.intensity}]"

    mi.register_emitter(NAME, CosinePoint)
    return CosinePoint
