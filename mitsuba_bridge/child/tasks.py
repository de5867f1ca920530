"""What the child can be asked for; imported there only, after the variant is set."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from nusselt.mitsuba_bridge.lights import EMITTERS
from nusselt.mitsuba_bridge.lobes import SURFACES

from . import phong
from .images import images
from .own_scene import parse_own
from .passes import Array
from .patch_irradiance import patches
from .race import race
from .reference import Progress, reference, tracing
from .scene_dict import bsdf_dict, scene_dict
from .sensors import sensors
from .variance import spread

Task = Callable[[dict[str, Any], Path, Progress], dict[str, Array]]

for _module in sorted({surface.module for surface in SURFACES if surface.module} | set(EMITTERS.values())):
    import_module(f".{_module}", __package__).register()


def llvm_version() -> str | None:
    """The LLVM Dr.Jit is using, None in a scalar variant."""
    return ".".join(map(str, dr.detail.llvm_version())) if str(mi.variant()).startswith("llvm") else None


def forget() -> None:
    """Give back the memory that the last job left."""
    dr.flush_malloc_cache()


def proof(job: dict[str, Any], folder: Path, progress: Progress) -> dict[str, Array]:
    """A real render with minima and maxima in it: what a broken LLVM aborts on."""
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "direct"},
            "sensor": {
                "type": "perspective",
                "to_world": mi.ScalarTransform4f().look_at([0, 0, 4], [0, 0, 0], [0, 1, 0]),
                "film": {"type": "hdrfilm", "width": 4, "height": 4, "rfilter": {"type": "box"}},
            },
            "ball": {"type": "sphere", "bsdf": {"type": "diffuse"}},
            "lamp": {
                "type": "rectangle",
                "to_world": mi.ScalarTransform4f().look_at([0, 3, 3], [0, 0, 0], [1, 0, 0]),
                "emitter": {"type": "area"},
            },
        }
    )
    image = np.array(mi.render(scene, spp=4))
    larger = np.array(dr.maximum(mi.Float([1, 2, 3]), mi.Float([3, 2, 1]))) if llvm_version() else np.array([3, 2, 3])
    if not (np.isfinite(image).all() and image.max() > 0 and larger.tolist() == [3, 2, 3]):
        raise RuntimeError("the proof came out wrong")
    return {"image": image}


def camera_rays(job: dict[str, Any], folder: Path, progress: Progress) -> dict[str, Array]:
    """Origins and directions (3, n) of the rays through the pixels' centres."""
    camera = job["description"]["camera"]
    sensor = mi.load_dict(scene_dict(job["description"], folder, ())).sensors()[0]
    x, y = (v.ravel() for v in np.meshgrid(np.arange(camera["width"]) + 0.5, np.arange(camera["height"]) + 0.5))
    place = mi.Point2f(mi.Float(x / camera["width"]), mi.Float(y / camera["height"]))
    ray, _ = sensor.sample_ray_differential(0.0, 0.5, place, mi.Point2f(0.5))
    return {"origin": np.array(ray.o), "direction": np.array(ray.d)}


def surface(job: dict[str, Any], folder: Path, progress: Progress) -> dict[str, Array]:
    """f cos and density of one surface for local directions ``wi``, ``wo`` (3, n) of the job."""
    bsdf = mi.load_dict(bsdf_dict(job["bsdf"], False))
    si = dr.zeros(mi.SurfaceInteraction3f, len(job["wi"][0]))
    si.wi = mi.Vector3f(np.array(job["wi"], dtype=np.float32))
    value, pdf = bsdf.eval_pdf(mi.BSDFContext(), si, mi.Vector3f(np.array(job["wo"], dtype=np.float32)))
    return {"value": np.array(value), "pdf": np.array(pdf)}


def chi_squared(job: dict[str, Any], folder: Path, progress: Progress) -> dict[str, Array]:
    """Mitsuba's own test that a surface samples what its density says; ``passed`` is 0 or 1."""
    xml = "".join(f'<float name="{name}" value="{value}"/>' for name, value in job["parameters"].items())
    kind = job.get("type", phong.NAME)
    sample, density = mi.chi2.BSDFAdapter(kind, xml, wi=mi.Vector3f(job["wi"]))
    test = mi.chi2.ChiSquareTest(
        domain=mi.chi2.SphericalDomain(),
        sample_func=sample,
        pdf_func=density,
        sample_dim=3,
        seed=job["seed"],
        ires=16,  # its default of 4 integrates a narrow lobe so badly that Mitsuba's own surfaces fail
    )
    passed = test.run(significance_level=job["level"])
    return {"passed": np.array(float(passed)), "p": np.array(test.p_value)}


def _through_centres(scene: Any, job: dict[str, Any]) -> Any:
    """(h, w, 3), each pixel from rays through its centre: the course's rule, which no film has."""
    width, height = scene.sensors()[0].film().size()
    camera = tracing.Camera(scene, width, height, False)
    mean = tracing.one_pass(scene, camera, np.arange(width * height), job["samples"], job["seed"])
    return mi.TensorXf(np.ascontiguousarray(mean.reshape(3, height, width).transpose(1, 2, 0), dtype=np.float32))


def image(job: dict[str, Any], folder: Path, progress: Progress) -> dict[str, Array]:
    """A plain `mi.render` of an XML file, for people: not a reference."""
    scene = mi.load_file(job["file"])
    found = (
        mi.render(scene, spp=job["samples"], seed=job["seed"]) if not job["centres"] else _through_centres(scene, job)
    )
    if job["output"] == ".exr":
        mi.Bitmap(found).write(str(folder / "image.exr"))
    return {"image": np.array(found)}


def epsilons(job: dict[str, Any], folder: Path, progress: Progress) -> dict[str, Array]:
    """By how much shadow rays are lifted off a surface, and stop short of a light; NaN where there is no such rule."""
    found = [getattr(mi.math, name, np.nan) for name in ("RayEpsilon", "ShadowEpsilon")]
    newer = hasattr(mi.math, "PositionEpsilon")  # the rule of Mitsuba 3.10
    return {"epsilons": np.array([np.nan, np.nan] if newer else found, dtype=np.float64)}


TASKS: dict[str, Task] = {
    "reference": reference,
    "race": race,
    "proof": proof,
    "camera_rays": camera_rays,
    "surface": surface,
    "chi_squared": chi_squared,
    "image": image,
    "images": images,
    "patches": patches,
    "spread": spread,
    "sensors": sensors,
    "parse_own": parse_own,
    "epsilons": epsilons,
}
