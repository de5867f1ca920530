"""What a scene file has said so far, and what each of its commands does to that."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from nusselt.renderer.errors import InputError
from nusselt.renderer.expected_pixel import ExpectedPixel
from nusselt.renderer.lights import Light, PointLight
from nusselt.renderer.mesh_files import Surface, find_inside, read_mesh_file
from nusselt.renderer.scene import INTEGRATORS, Camera, Scene
from nusselt.renderer.sensor import Sensor
from nusselt.renderer.surfaces import Ellipsoid, Material, Mesh
from nusselt.renderer.validation import Vec3, parallel
from nusselt.renderer.words import count

from . import transforms
from .triangle_pile import TrianglePile

MAX_PUSHED = 100_000
MAX_SENSORS = 65_536
_INTEGRATORS = ("analyticdirect", "direct", "raytracer", "pathtracer")


def check_output(name: str) -> str:
    """``name``, if it is a bare printable file name without blanks: one that cannot leave a folder."""
    bare = name.isprintable() and not set(name) & set("/\\: ") and name not in ("", ".", "..")
    if not bare or len(name.encode()) > 255:
        raise InputError("output", name, "a bare file name: no folder, blank or control character")
    return name


def _vec(values: Sequence[float]) -> Vec3:
    return values[0], values[1], values[2]


class SceneState:
    """The state that commands change, and what they have built so far.

    Parameters
    ----------
    where : str
        What errors and warnings call the file. ``line`` is set by whoever feeds the commands.
    folder : path, optional
        The file's folder, where its mesh files are; None: a text has none.
    """

    def __init__(self, where: str, folder: Path | None = None) -> None:
        self.where, self.line, self._folder = where, 1, folder
        self.pile = TrianglePile(where)
        self.transform, self._pushed = transforms.IDENTITY, list[transforms.Affine]()
        self._settings: dict[str, tuple[Any, int]] = {}  # by command: its value, its line
        self._parameters: dict[str, Any] = {}  # of lobes, by command
        self._material, self._emission_line = Material(), 0
        self._lit: Callable[[Mesh], Light] | None = None  # what makes lights of surfaces
        self._meshes, self._ellipsoids, self._lights = list[Mesh](), list[Ellipsoid](), list[Light]()
        self._sensors = list[Sensor]()
        self._pixels = list[tuple[ExpectedPixel, int]]()  # and the line of each
        self._lines: tuple[list[int], list[int], list[int]] = ([], [], [])
        self._surfaces: dict[str, Surface] = {}  # by file name
        self._attenuated, self._bare_point = False, 0  # is there a law for points, line of the first without one
        self._warned: dict[str, list[Any]] = {}  # by message: its first place, how often

    @property
    def is_pushed(self) -> bool:
        return bool(self._pushed)

    @property
    def place(self) -> str:
        return f"{self.where}:{self.line}"

    def warn(self, message: str, place: str) -> None:
        """Note what is ignored; the same message again is only counted."""
        self._warned.setdefault(message, [place, 0])[1] += 1

    @property
    def warnings(self) -> tuple[str, ...]:
        """One line each: the first place, the message, and how many more places."""
        return tuple(
            f"{place}: {message}" + (f" (and {count - 1} more)" if count > 1 else "")
            for message, (place, count) in self._warned.items()
        )

    def scene(self, name: str) -> Scene:
        """The scene, once every command is read; an error in a setting names the setting's line."""
        self._close_mesh()
        for needed, accepted in (("size", "size width height"), ("camera", "one camera command")):
            if needed not in self._settings and not self._sensors:
                raise InputError(needed, "missing", accepted, self.place)
        width, height = self._setting("size", (1, 1))
        integrator = self._integrator()
        self._tell_falloff()
        try:
            return Scene(
                width=width,
                height=height,
                camera=self._setting("camera", None) or _looking_at(self._sensors[0]),
                meshes=tuple(self._meshes),
                ellipsoids=tuple(self._ellipsoids),
                lights=tuple(self._lights),
                integrator=integrator,
                light_samples=self._setting("lightsamples", 1),
                stratify=self._setting("lightstratify", False),
                spp=self._setting("spp", 1),
                sensors=tuple(self._sensors),
                pixels=tuple(self._inside(width, height)),
                name=name,
                output=self._setting("output", "raytrace.png"),
                warnings=self.warnings,
                lines=tuple(map(tuple, self._lines)),
            )
        except InputError as error:
            _, line = self._settings.get(error.argument.split()[0], (None, self.line))
            raise error.at(f"{self.where}:{line}") from None

    def _inside(self, width: int, height: int) -> Iterator[ExpectedPixel]:
        """The expected pixels, each of the image, none twice."""
        taken: set[tuple[int, int]] = set()
        for pixel, line in self._pixels:
            place, where = (pixel.x, pixel.y), f"{self.where}:{line}"
            if pixel.x >= width or pixel.y >= height:
                raise InputError("expectPixel", place, f"a pixel of {width} x {height}, from 0", where)
            if place in taken:
                raise InputError("expectPixel", f"{place} a second time", "one for each pixel", where)
            taken.add(place)
            yield pixel

    def _set(self, command: str, value: Any) -> None:
        self._settings[command] = value, self.line

    def _setting(self, command: str, default: Any) -> Any:
        return self._settings.get(command, (default, 0))[0]

    def _integrator(self) -> str:
        name, line = self._settings.get("integrator", ("direct", self.line))
        if name not in INTEGRATORS:
            self.warn(f"integrator {name}: direct is used", f"{self.where}:{line}")
        elif not self._settings.keys() & {"integrator", "lightsamples"} and any(x.has_extent for x in self._lights):
            self.warn("no integrator and no lightsamples: direct is used, 1 sample per light", f"{self.where}:{line}")
        return str(name) if name in INTEGRATORS else "direct"

    def _tell_falloff(self) -> None:
        """CSE 167's rule, where a file looks like one of its."""
        is_old = self._setting("integrator", "raytracer") == "raytracer" and not any(x.has_extent for x in self._lights)
        if self._bare_point and is_old:
            message = "point without attenuation: in CSE 167 it does not fall off, here light falls off as 1/R^2"
            self.warn(message, f"{self.where}:{self._bare_point}")

    def size(self, width: int, height: int) -> None:
        self._set("size", (width, height))

    def output(self, name: str) -> None:
        *folder, name = name.replace("\\", "/").split("/")
        if folder:
            self.warn("output: its folder is ignored", self.place)
        self._set("output", check_output(name))

    def camera(self, *v: float) -> None:
        self._set("camera", Camera(_vec(v), _vec(v[3:]), _vec(v[6:]), v[9]))

    def integrator(self, name: str) -> None:
        if name not in _INTEGRATORS:
            raise InputError("integrator", name, " or ".join(_INTEGRATORS))
        self._set("integrator", name)

    def lightsamples(self, count: int) -> None:
        self._set("lightsamples", count)

    def lightstratify(self, switch: str) -> None:
        if switch not in ("on", "off"):
            raise InputError("lightstratify", switch, "on or off")
        self._set("lightstratify", switch == "on")

    def spp(self, count: int) -> None:
        self._set("spp", count)

    def accepted(self, count: int) -> None:
        """Of other homeworks; direct lighting does not need it."""

    def gamma(self, exponent: float) -> None:
        if exponent != 1:
            self.warn("gamma ignored: images are linear; only how a PNG is written would change", self.place)

    def brdf(self, name: str) -> None:
        if name != "phong":
            raise InputError("brdf", name, "phong, with its diffuse, specular and shininess: no other is supported")

    def attenuation(self, *factors: float) -> None:
        self._attenuated = True
        if factors != (0, 0, 1):
            self.warn("attenuation ignored: light falls off as 1/R^2", self.place)

    def ambient(self, *colour: float) -> None:
        self.warn("ambient ignored: it is not direct lighting", self.place)

    def vertex(self, *point: float) -> None:
        self.pile.add_vertices(point)

    def tri(self, *corners: int) -> None:
        count = self.pile.vertex_count
        for name, corner in zip("ijk", corners, strict=True):
            if not 0 <= corner < count:
                raise InputError(f"tri {name}", corner, f"an index of the {count} vertices so far, from 0")
        self.pile.add_triangles(corners, self.line, self.transform)

    def mesh(self, name: str) -> None:
        """The triangles of a PLY or OBJ file, a mesh of their own."""
        if self._folder is None:
            raise InputError("mesh", name, "a scene that is a file: a text has no folder to look in")
        try:
            if name not in self._surfaces:  # a shape may stand in many places
                self._surfaces[name] = read_mesh_file(find_inside(self._folder, name))
            surface = self._surfaces[name]
        except InputError as error:
            raise (error.at(f"{self.place}: {error.where}") if error.where else error) from None
        x, y, z = surface.vertices
        with np.errstate(over="ignore", invalid="ignore"):  # Mesh refuses what overflows
            vertices = np.stack([a * x + b * y + c * z + d for a, b, c, d in self.transform])
        surface, dropped = replace(surface, vertices=vertices).with_area()
        if not surface.triangles.size:
            raise InputError("mesh", f"{name}, no area", "a triangle that spans an area")
        for note in (*surface.notes, *[f"{count(dropped, 'triangle')} without area: dropped"] * bool(dropped)):
            self.warn(f"{name}: {note}", self.place)
        self._close_mesh()
        self._add_mesh(Mesh(surface.vertices, surface.triangles, self._material), self.line)

    def sphere(self, x: float, y: float, z: float, radius: float) -> None:
        if radius <= 0:
            raise InputError("sphere radius", radius, "a radius above 0")
        if self._lit is not None:
            raise InputError("sphere", "after meshLight", "tri or mesh; sphereLight is a ball that shines")
        a, b, c = ((i * radius, j * radius, k * radius) for i, j, k, _ in self.transform)
        center = transforms.apply(self.transform, (x, y, z))
        ellipsoid = Ellipsoid(center, (a, b, c), self._material)
        if (true_radius := ellipsoid.radius) is not None:  # a turned or mirrored sphere is a sphere
            ellipsoid = Ellipsoid.sphere(center, true_radius, self._material)
        self._ellipsoids.append(ellipsoid)
        self._lines[1].append(self.line)
        self._tell_emission()

    def translate(self, *offset: float) -> None:
        self._turn("translate", transforms.translation(_vec(offset)))

    def rotate(self, x: float, y: float, z: float, degrees: float) -> None:
        self._turn("rotate", transforms.rotation((x, y, z), degrees))

    def scale(self, *factors: float) -> None:
        self._turn("scale", transforms.scaling(_vec(factors)))

    def _turn(self, name: str, affine: transforms.Affine) -> None:
        turned = transforms.compose(self.transform, affine)
        if not transforms.is_finite(turned):
            raise InputError(name, "overflow", "a current transform that stays finite")
        self.transform = turned

    def push(self) -> None:
        if len(self._pushed) >= MAX_PUSHED:
            raise InputError("pushTransform", f"{MAX_PUSHED + 1} deep", f"at most {MAX_PUSHED} deep")
        self._pushed.append(self.transform)

    def pop(self) -> None:
        if not self._pushed:
            raise InputError("popTransform", "an empty stack", "an earlier pushTransform that is still open")
        self.transform = self._pushed.pop()

    def parameter(self, name: str, value: tuple[float, ...] | float) -> None:
        """Set a parameter of a lobe."""
        self._parameters[name] = value
        self._surface(self._material.emission)

    def emission(self, *rgb: float) -> None:
        self._surface(_vec(rgb))
        self._emission_line = self.line

    def _surface(self, emission: Vec3) -> None:
        """Change the material; a mesh ends here even at no change, so that written scenes come back equal."""
        self._close_mesh()
        self._material = Material.of(self._parameters, emission)

    def _close_mesh(self) -> None:
        first = self.pile.first_line
        if mesh := self.pile.close(self._material):
            self._add_mesh(mesh, first)

    def _add_mesh(self, mesh: Mesh, line: int) -> None:
        """A surface, or a light, from a line on."""
        if self._lit is not None:
            try:
                self._add_light(self._lit(mesh), line)
            except InputError as error:
                raise error.at(f"{self.where}:{line}") from None
            return
        self._meshes.append(mesh)
        self._lines[0].append(line)
        self._tell_emission()

    def lit(self, make: Callable[[Mesh], Light], shines: bool) -> None:
        """Make lights of the surfaces that follow, or no more of them."""
        self._close_mesh()
        self._lit = make if shines else None

    def _tell_emission(self) -> None:
        if max(self._material.emission) > 0:
            message = "emission on an ordinary object is seen but lights nothing"
            self.warn(message, f"{self.where}:{self._emission_line}")

    def light(self, light: Light) -> None:
        if self._lit is not None:
            self._close_mesh()  # lights stay in the order of their lines
        self._add_light(light, self.line)

    def _add_light(self, light: Light, line: int) -> None:
        self._lights.append(light)
        self._lines[2].append(line)
        if isinstance(light, PointLight) and not self._attenuated and not self._bare_point:
            self._bare_point = self.line

    def sensor(self, *v: float) -> None:
        self._add_sensors([Sensor(_vec(v), _vec(v[3:]))])

    def sensor_grid(self, *v: float) -> None:
        """The middles of a parallelogram's cells, row by row along ab."""
        corner, ab, ac = (np.array(_vec(v[k:])) for k in (0, 3, 6))
        if not ab.any() or not ac.any() or parallel(_vec(v[3:]), _vec(v[6:])):
            raise InputError("sensorGrid ac", _vec(v[6:]), "an edge that spans a parallelogram with ab")
        sides = []
        for name, number in zip(("nab", "nac"), v[12:], strict=True):
            if number != int(number) or not 1 <= number <= MAX_SENSORS:
                raise InputError(f"sensorGrid {name}", number, f"a whole number from 1 to {MAX_SENSORS}")
            sides.append((np.arange(int(number)) + 0.5) / number)
        if sides[0].size * sides[1].size > MAX_SENSORS:
            raise InputError("sensorGrid nab", v[12], f"at most {MAX_SENSORS} sensors in all")
        places = corner + sides[1][:, None, None] * ac + sides[0][None, :, None] * ab
        self._add_sensors([Sensor(_vec(place), _vec(v[9:])) for place in places.reshape(-1, 3).tolist()])

    def _add_sensors(self, sensors: list[Sensor]) -> None:
        if len(self._sensors) + len(sensors) > MAX_SENSORS:
            raise InputError("sensor", f"number {MAX_SENSORS + 1}", f"at most {MAX_SENSORS} in a scene")
        self._sensors += sensors

    def expect(self, *v: float) -> None:
        """What the last sensor should read."""
        if not self._sensors:
            raise InputError("expect", "no sensor before it", "a sensor first: sensor x y z nx ny nz")
        if self._sensors[-1].expected is not None:
            raise InputError("expect", "a second time", "one for each sensor")
        self._sensors[-1] = replace(self._sensors[-1], expected=_vec(v), percent=v[3])

    def expect_pixel(self, *v: float) -> None:
        """What a pixel should show."""
        if len(self._pixels) == MAX_SENSORS:
            raise InputError("expectPixel", f"number {MAX_SENSORS + 1}", f"at most {MAX_SENSORS} in a scene")
        self._pixels.append((ExpectedPixel(v[0], v[1], _vec(v[2:]), v[5]), self.line))  # type: ignore[arg-type]


def _looking_at(sensor: Sensor) -> Camera:
    """For a scene of sensors alone: a camera on the lit side of one."""
    position, normal = np.array(sensor.position), np.array(sensor.normal)
    away = max(1.0, float(np.abs(position).max()))
    up = np.eye(3)[np.abs(normal).argmin()]
    return Camera(_vec((position + away * normal).tolist()), sensor.position, _vec(up.tolist()), 45.0)
