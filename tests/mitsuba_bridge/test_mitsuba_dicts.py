"""What `mi.load_dict` takes, judged as a file is: the same scene, and its places in messages are those in the dict."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
import pytest

import nusselt
from nusselt.mitsuba_bridge.origin import own_file
from nusselt.mitsuba_bridge.reference import render_reference
from nusselt.renderer.errors import InputError

pytestmark = pytest.mark.mitsuba

OBJ = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n"
XML = """<scene version="3.0.0">
<sensor type="perspective"><float name="fov" value="40.1"/>
<transform name="to_world"><lookat origin="0.5,2,6" target="0,0.5,0" up="0,1,0"/></transform>
<film type="hdrfilm"><integer name="width" value="24"/><integer name="height" value="16"/></film></sensor>
<bsdf type="twosided" id="grey"><bsdf type="diffuse"><rgb name="reflectance" value="0.5,0.4,0.3"/></bsdf></bsdf>
<shape type="rectangle" id="floor"><ref id="grey"/>
<transform name="to_world"><scale value="3.3"/><rotate x="1" angle="-90"/></transform></shape>
<shape type="obj" id="leaf"><string name="filename" value="leaf.obj"/><boolean name="face_normals" value="true"/>
<ref id="grey"/></shape>
<emitter type="point" id="bulb"><point name="position" x="1" y="3" z="1"/>
<rgb name="intensity" value="1,2,3"/></emitter>
<shape type="rectangle" id="lamp"><transform name="to_world"><scale x="0.5" y="0.25"/><rotate x="1" angle="90"/>
<translate y="2.5"/></transform><emitter type="area"><rgb name="radiance" value="9,8,7"/></emitter></shape>
</scene>"""


def as_dict(**changes):
    """The same as `XML`; transforms in double precision, as Mitsuba reads those of files."""
    t = mi.ScalarTransform4d
    film = {"type": "hdrfilm", "width": 24, "height": np.int64(16)}
    look = t().look_at([0.5, 2, 6], [0, 0.5, 0], [0, 1, 0])
    two = {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.5, 0.4, 0.3]}}}
    down = t().translate([0, 2.5, 0]).rotate([1, 0, 0], 90).scale([0.5, 0.25, 1])
    return {
        "type": "scene",
        "sensor": {"type": "perspective", "fov": 40.1, "to_world": look, "film": film},
        "grey": two,
        "floor": {
            "type": "rectangle",
            "to_world": t().rotate([1, 0, 0], -90).scale(3.3),
            "bsdf": {"type": "ref", "id": "grey"},
        },
        "leaf": {"type": "obj", "filename": "leaf.obj", "face_normals": True, "bsdf": {"type": "ref", "id": "grey"}},
        "bulb": {"type": "point", "position": np.array([1.0, 3.0, 1.0]), "intensity": mi.ScalarColor3f(1, 2, 3)},
        "lamp": {
            "type": "rectangle",
            "to_world": down,
            "emitter": {"type": "area", "radiance": {"type": "rgb", "value": [9, 8, 7]}},
        },
        **changes,
    }


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """Where files are that a scene names; Mitsuba's own objects are made by this process."""
    mi.set_variant("scalar_rgb")
    (tmp_path / "leaf.obj").write_text(OBJ)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_dict_is_the_scene_of_the_same_file(folder):
    (folder / "same.xml").write_text(XML)
    file, given = nusselt.read_scene("same.xml"), nusselt.read_scene(as_dict())
    assert given.digest() == file.digest()
    assert np.array_equal(nusselt.render(given, estimator="exact").array, nusselt.render(file, estimator="exact").array)
    few = {"seed": 1, "target_relative_se": 0.1, "max_samples": 4, "timeout": 60, "passes": 2}
    first, second = (render_reference(scene, **few) for scene in (file, given))
    assert np.array_equal(first.mean, second.mean)  # Mitsuba, too, has the same scene
    assert any("the file itself" in note for note in second.notes)


def test_a_dict_is_judged_and_the_row_says_how_to_ask_again():
    results = nusselt.check(as_dict(), estimator="exact", margin=0.02)
    assert results.agrees, str(results)
    assert results.row["command"] == "nusselt.check(<dict>, estimator='exact', margin=0.02)"


def test_one_that_was_changed_is_no_longer_the_dict_s():
    scene = nusselt.read_scene(as_dict())
    assert own_file(scene)["words"]
    assert own_file(scene.with_(two_sided=False)) is None


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("pipe", {"type": "cylinder"}, r"^dict\.pipe: cylinder"),
        ("ball", {"type": "sphere", "bsdf": {"type": "dielectric"}}, r"^dict\.ball\.bsdf: .*--as-diffuse"),
        ("ball", {"type": "sphere", "radius": None}, r"^dict\.ball\.radius: radius = a NoneType"),
        ("ball", {"type": "sphere", "bsdf": {"type": "ref", "id": "none"}}, 'id="none" exists'),
        ("leaf", {"type": "obj", "filename": "missing.obj"}, "missing.obj"),
        ("thing", {"kind": "sphere"}, r"^dict\.thing: type = none"),
    ],
)
def test_the_rest_is_refused_by_its_place_in_the_dict(name, value, words):
    with pytest.raises(InputError, match=words):
        nusselt.read_scene(as_dict(**{name: value}))


def test_what_another_process_has_loaded_does_not_cross():
    for loaded in (mi.load_dict({"type": "sphere"}), {"type": "bitmap", "bitmap": mi.Bitmap(np.zeros((2, 2, 3)))}):
        with pytest.raises(InputError, match="into a file that is named"):
            nusselt.read_scene(as_dict(thing=loaded))
