"""The modified Phong surface, as a Mitsuba BSDF; nothing Mitsuba ships is equal to it.

f = kd/pi + ks (s+2)/(2 pi) max(r.wo, 0)^s with r the mirror image of wi, one-sided. Imported in the child only,
after the variant is set.
"""

from __future__ import annotations

import math
from typing import Any

import drjit as dr
import mitsuba as mi

NAME = "modified_phong"


def register() -> type:
    """Make the surface known to the current variant; returns its class."""

    class ModifiedPhong(mi.BSDF):
        def __init__(self, props: Any) -> None:
            super().__init__(props)
            self.kd = props.get_unbounded_texture("kd", 0.5)
            self.ks = props.get_unbounded_texture("ks", 0.0)
            self.exponent = float(props.get("exponent", 30.0))
            # Only for sampling the surface; any share in (0, 1) is unbiased.
            self.share = float(props.get("specular_probability", 0.5))
            front = mi.BSDFFlags.FrontSide
            self.m_components = [mi.BSDFFlags.DiffuseReflection | front, mi.BSDFFlags.GlossyReflection | front]
            self.m_flags = self.m_components[0] | self.m_components[1]

        def power(self, wi: Any, wo: Any) -> Any:
            """max(r.wo, 0)^s. 1 - r.wo = |r - wo|^2 / 2 keeps the digits that float32 loses in r.wo near 1."""
            x, y, z = wo.x + wi.x, wo.y + wi.y, wo.z - wi.z
            fall = 0.5 * dr.fma(x, x, dr.fma(y, y, z * z))
            if self.exponent == 0:
                return dr.select(fall < 1, mi.Float(1), mi.Float(0))
            # log(1 - fall) by Kahan's log1p: the rounding of u cancels between numerator and denominator.
            u = 1 - fall
            safe = dr.select(u == 1, mi.Float(0.5), u)
            log = dr.select(u == 1, -fall, dr.log(dr.maximum(safe, 1e-30)) * fall / (1 - safe))
            return dr.select(u > 0, dr.exp(self.exponent * log), mi.Float(0))

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            cos_i, cos_o = mi.Frame3f.cos_theta(si.wi), mi.Frame3f.cos_theta(wo)
            active = active & (cos_i > 0) & (cos_o > 0)
            power = self.power(si.wi, wo)
            lobe = (self.exponent + 2) / (2 * math.pi) * power
            value = (self.kd.eval(si, active) * (1 / math.pi) + self.ks.eval(si, active) * lobe) * cos_o
            pdf = (1 - self.share) * cos_o * (1 / math.pi)
            pdf += self.share * (self.exponent + 1) / (2 * math.pi) * power
            return dr.select(active, value, mi.Color3f(0)), dr.select(active, pdf, mi.Float(0))

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[0]

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[1]

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            active = active & (mi.Frame3f.cos_theta(si.wi) > 0)
            glossy = sample1 < self.share
            cosine = dr.power(sample2.y, 1 / (self.exponent + 1))
            sine = dr.safe_sqrt(1 - cosine * cosine)
            sin_phi, cos_phi = dr.sincos(2 * dr.pi * sample2.x)
            mirror = mi.Frame3f(mi.Vector3f(-si.wi.x, -si.wi.y, si.wi.z))
            around = mirror.to_world(mi.Vector3f(cos_phi * sine, sin_phi * sine, cosine))
            bs: Any = mi.BSDFSample3f()
            bs.wo = dr.select(glossy, around, mi.warp.square_to_cosine_hemisphere(sample2))
            bs.eta = 1.0
            bs.sampled_component = dr.select(glossy, mi.UInt32(1), mi.UInt32(0))
            bs.sampled_type = dr.select(
                glossy, mi.UInt32(int(mi.BSDFFlags.GlossyReflection)), mi.UInt32(int(mi.BSDFFlags.DiffuseReflection))
            )
            value, bs.pdf = self.eval_pdf(ctx, si, bs.wo, active)
            drawn = active & (bs.pdf > 0)
            return bs, dr.select(drawn, value / dr.select(drawn, bs.pdf, mi.Float(1)), mi.Color3f(0))

        def traverse(self, callback: Any) -> None:
            callback.put("kd", self.kd, mi.ParamFlags.Differentiable)
            callback.put("ks", self.ks, mi.ParamFlags.Differentiable)

        def to_string(self) -> str:
            return f"ModifiedPhong[kd={self.kd}, ks={self.ks}, exponent={self.exponent}]"

    mi.register_bsdf(NAME, ModifiedPhong)
    return ModifiedPhong
