"""USD: what is read means what UsdLux and UsdGeom say, the rest is refused by prim; what is written is read again."""

import math

import numpy as np
import pytest
from builders import GREY, box, floor, scene
from test_lights import EXAMPLES, shading_points_of

from nusselt.experiments.exchange.usd import read_usd, usd_text
from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import Area
from nusselt.renderer.image import render
from nusselt.renderer.lights import LIGHTS, CosineLight, MeshLight, SpotLight
from nusselt.renderer.surfaces import Ellipsoid, Material

needs_usd = pytest.mark.usefixtures("usd")
NONE = (SpotLight, CosineLight)
"""Kinds that USD has no equal of."""
BALLS = (
    Ellipsoid((0.5, 0.5, 0.5), ((0.3, 0.1, 0), (0, 0.2, 0), (0, 0, 0.4)), GREY),
    Ellipsoid.sphere((-0.5, 0.5, 0.5), 0.25, Material((0.1, 0.5, 0.2), emission=(0.5, 0.0, 0.25))),
)


@pytest.fixture(scope="session")
def usd():
    pytest.importorskip("pxr", reason="usd-core is not installed: pip install 'nusselt[usd]'")


def room(light, **options):
    block = box((-0.5, 0, -0.5), (0, 0.5, 0))
    return scene(floor(), block, ellipsoids=BALLS, lights=(light,), size=(20, 15), **options)


@pytest.mark.parametrize("kind", [kind for kind in LIGHTS if kind not in NONE], ids=lambda kind: kind.kind)
@needs_usd
def test_what_is_written_is_read_again(kind, tmp_path):
    """In single precision: the same image but for that."""
    made = room(EXAMPLES[kind], two_sided=kind.surrounds)
    (tmp_path / "scene.usda").write_text(usd_text(made))
    again = read_usd(tmp_path / "scene.usda")
    assert (type(again.lights[0]), again.two_sided, again.light_samples) == (kind, made.two_sided, 16)
    assert all("lights nothing" in note for note in again.warnings)
    first, second = (render(each, Area(samples=16, stratified=True), seed=3).mean for each in (made, again))
    assert np.abs(first - second).max() < 1e-5 * first.max()


def test_the_text_needs_no_package_and_refuses_what_usd_has_no_equal_of():
    text = usd_text(room(EXAMPLES[MeshLight]))
    assert text.startswith("#usda 1.0\n")
    assert text.count("{") == text.count("}")
    for told in ("MeshLightAPI", "noMaterialResponse", 'subdivisionScheme = "none"', "resolution = (20, 15)"):
        assert told in text
    for kind in NONE:
        with pytest.raises(InputError, match=f"a {kind.kind}"):
            usd_text(room(EXAMPLES[kind]))
    with pytest.raises(InputError, match="glossy"):
        usd_text(scene(floor(material=Material((0.1,) * 3, (0.2,) * 3, 5.0))))


CAMERA = """def Camera "Eye" {
    double3 xformOp:translate = (0, 0, 5)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
"""
SETTINGS = """def RenderSettings "Settings" {
    uniform int2 resolution = (40, 30)
}
"""


def read(tmp_path, body, head=CAMERA + SETTINGS, **options):
    (tmp_path / "a.usda").write_text("#usda 1.0\n" + head + body)
    return read_usd(tmp_path / "a.usda", **options)


def light(kind, lines="", place="", api="", inside=""):
    turn = f"float3 xformOp:rotateXYZ = (-90, 0, 0)\ndouble3 xformOp:translate = {place}\n" if place else ""
    order = 'uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateXYZ"]\n' if place else ""
    apis = f' (prepend apiSchemas = ["{api}"])' if api else ""
    return f'def {kind} "L"{apis} {{\n{turn}{order}{lines}\n{inside}}}\n'


def nadir(made):
    """Radiance of a surface of albedo 0.18 at the origin that faces up."""
    (lamp,) = made.lights
    points = shading_points_of(np.zeros((3, 1)), np.array([[0.0], [1.0], [0.0]]))
    return 0.18 * lamp.unshadowed(points, False)[0][0, 0]


@pytest.mark.parametrize(
    ("text", "right"),
    [
        (light("RectLight", "float inputs:intensity = 10", "(0, 1, 0)"), 0.43102),
        (light("RectLight", "float inputs:intensity = 5\nfloat inputs:exposure = 1", "(0, 1, 0)"), 0.43102),
        (
            light(
                "RectLight",
                "float inputs:intensity = 40\nfloat inputs:width = 2\nbool inputs:normalize = 1",
                "(0, 3, 0)",
            ),
            None,
        ),
        (light("DiskLight", "float inputs:intensity = 30", "(0, 2, 0)"), 0.31765),
        (light("SphereLight", "float inputs:intensity = 30", "(0, 2, 0)"), 0.33750),
        (
            light("DistantLight", "float inputs:intensity = 3\nbool inputs:normalize = 1", "(0, 0, 0)"),
            0.18 * 3 / math.pi,
        ),
        (light("DistantLight", place="(0, 0, 0)"), 0.18 * 50000 * math.sin(math.radians(0.265)) ** 2),
        (light("DistantLight", "float inputs:angle = 0", "(0, 0, 0)"), 0.18 * 50000 / math.pi),
        (light("DomeLight"), 0.18),
        (light("SphereLight", "bool treatAsPoint = 1\nfloat inputs:radius = 0.1", "(0, 2, 0)"), 0.18 * 0.01 / 4),
        (
            light("SphereLight", "bool treatAsPoint = 1\nbool inputs:normalize = 1", "(0, 2, 0)"),
            0.18 / 4 / 4 / math.pi,
        ),
    ],
)
@needs_usd
def test_lights_give_what_usdlux_says(tmp_path, text, right):
    """Published figures of UsdLux's own comparison of renderers where there are some, else closed forms."""
    made = read(tmp_path, text)
    if right is None:  # twice as large, and normalised: a half of 40
        (lamp,) = made.lights
        assert (lamp.radiance, lamp.area, lamp.normal) == ((20, 20, 20), pytest.approx(2), pytest.approx((0, -1, 0)))
        assert any("the stage's own unit" in note for note in made.warnings)
        return
    assert nadir(made) == pytest.approx(right, rel=2e-5)


@needs_usd
def test_the_aperture_is_fitted_as_the_settings_say(tmp_path):
    tangent = 15.2908 / 2 / 50
    for policy, right in (
        ("", 20.955 / 2 / 50 * 0.75),  # 4 : 3 is narrower than the aperture: its height grows
        ("cropAperture", tangent),
        ("adjustApertureWidth", tangent),
        ("adjustApertureHeight", 20.955 / 2 / 50 * 0.75),
    ):
        line = f'uniform token aspectRatioConformPolicy = "{policy}"\n}}' if policy else "}"
        made = read(tmp_path, light("DomeLight"), CAMERA + SETTINGS.replace("}", line))
        assert math.tan(math.radians(made.camera.fov_y) / 2) == pytest.approx(right, rel=1e-6), policy
    unsaid = read(tmp_path, light("DomeLight"), CAMERA)
    assert (unsaid.width, unsaid.height) == (640, 467)
    assert "no RenderSettings" in unsaid.warnings[0]
    assert unsaid.camera.target == pytest.approx((0, 0, 4))


MESH = """point3f[] points = [(0,0,0), (1,0,0), (1,1,0), (0,1,0)]
int[] faceVertexCounts = [4]
int[] faceVertexIndices = [0, 1, 2, 3]
"""
MIRROR = 'float3 xformOp:scale = (-1, 1, 1)\nuniform token[] xformOpOrder = ["xformOp:scale"]\n'


@needs_usd
def test_fronts_stay_outside(tmp_path):
    none = 'uniform token subdivisionScheme = "none"\n'
    left = 'uniform token orientation = "leftHanded"\n'
    for more, front in (("", 1), (left, -1), (MIRROR, 1), (left + MIRROR, -1)):
        made = read(tmp_path, f'def Mesh "M" {{\n{MESH}{none}{more}}}\n')
        a, b, c = made.meshes[0].corners
        assert np.sign(np.cross(b - a, c - a, axis=0)[2]).tolist() == [front, front], more
        assert made.meshes[0].material.diffuse == pytest.approx((0.18,) * 3)
    said = read(tmp_path, f'def Mesh "M" {{\n{MESH}color3f[] primvars:displayColor = [(0.5, 0.25, 0.125)]\n}}\n')
    assert said.meshes[0].material.diffuse == (0.5, 0.25, 0.125)
    (note,) = said.warnings
    assert note.endswith(
        "a.usda:/M: subdivisionScheme catmullClark: the polygons are taken as they are, not subdivided"
    )
    cube = read(tmp_path, 'def Cube "C" {\ndouble size = 3\n}\n').meshes[0]
    assert (cube.vertices.min(), cube.vertices.max(), cube.triangles.shape) == (-1.5, 1.5, (3, 12))


@needs_usd
def test_instances_and_what_is_hidden(tmp_path):
    group = 'def Xform "G" (instanceable = true) {\n def Sphere "S" {\n double radius = 0.5\n }\n}\n'
    copy = (
        'def "I" (instanceable = true\n references = </G>) {\n double3 xformOp:translate = (2, 0, 0)\n'
        ' uniform token[] xformOpOrder = ["xformOp:translate"]\n}\n'
    )
    hidden = (
        'def Sphere "H" {\n token visibility = "invisible"\n}\ndef Sphere "P" {\n uniform token purpose = "guide"\n}\n'
    )
    made = read(tmp_path, group + copy + hidden)
    assert [body.center for body in made.ellipsoids] == [(0, 0, 0), (2, 0, 0)]
    assert any("/H: is invisible" in note for note in made.warnings)


def preview(lines="", more=""):
    bind = "rel material:binding = </M>"
    return (
        f'def Sphere "S" (prepend apiSchemas = ["MaterialBindingAPI"]) {{\n{bind}\n}}\ndef Material "M" {{\n'
        'token outputs:surface.connect = </M/P.outputs:surface>\ndef Shader "P" {\n'
        f'uniform token info:id = "UsdPreviewSurface"\n{lines}\ntoken outputs:surface\n}}\n{more}}}\n'
    )


@needs_usd
def test_surfaces_are_their_diffuse_colour(tmp_path):
    made = read(tmp_path, preview("color3f inputs:diffuseColor = (0.5, 0.25, 0.125)"))
    assert made.ellipsoids[0].material.diffuse == (0.5, 0.25, 0.125)
    assert "gloss" in made.warnings[0]
    with pytest.raises(InputError, match="metallic"):
        read(tmp_path, preview("float inputs:metallic = 1"))
    told = read(tmp_path, preview("float inputs:metallic = 1"), as_diffuse=True)
    assert "metallic is left out" in told.warnings[0]


@needs_usd
def test_constants_are_followed_through_connections_and_what_a_shader_makes_is_none(tmp_path):
    """A material's own input, and, where there is none to be found, the value beside the connection."""
    tint = "color3f inputs:diffuseColor.connect = </M.inputs:tint>"
    made = read(tmp_path, preview(tint, "color3f inputs:tint = (0.5, 0.25, 0.125)\n"))
    assert made.ellipsoids[0].material.diffuse == (0.5, 0.25, 0.125)
    own = read(tmp_path, preview(f"color3f inputs:diffuseColor = (0.25, 0.5, 0.5)\n{tint}"))
    assert own.ellipsoids[0].material.diffuse == (0.25, 0.5, 0.5)
    image = 'def Shader "T" {\nuniform token info:id = "UsdUVTexture"\nfloat3 outputs:rgb\n}\n'
    with pytest.raises(InputError, match="diffuseColor that is connected"):
        read(tmp_path, preview("color3f inputs:diffuseColor.connect = </M/T.outputs:rgb>", image))


@needs_usd
def test_what_usd_core_warns_of_is_said_and_nothing_is_written_beside(tmp_path, capfd):
    made = read(tmp_path, preview().replace(' (prepend apiSchemas = ["MaterialBindingAPI"])', ""))
    (said,) = [note for note in made.warnings if "usd-core" in note]
    assert said.startswith(f"{tmp_path}/a.usda: usd-core: Found material bindings on prim at path (/S)")
    with pytest.raises(InputError, match=r"a\.usda: scene = not composed"):
        read(tmp_path, 'def "R" (references = @./gone.usda@) {\n}\n')
    assert capfd.readouterr() == ("", "")


SHAPED = "ShapingAPI"
REFUSED = {
    "cylinder": (light("CylinderLight"), "CylinderLight", "/L"),
    "cone": (light("DiskLight", "float inputs:shaping:cone:angle = 30", api=SHAPED), "cone:angle 30", "/L"),
    "profile": (light("RectLight", "asset inputs:shaping:ies:file = @a.ies@", api=SHAPED), "ies", "/L"),
    "texture": (light("DomeLight", "asset inputs:texture:file = @a.exr@"), "texture", "/L"),
    "diffuse": (light("RectLight", "float inputs:diffuse = 0.5"), "inputs:diffuse 0.5", "/L"),
    "shadows": (light("RectLight", "bool inputs:shadow:enable = 0", api="ShadowAPI"), "shadow", "/L"),
    "type": (light("RectLight", 'string inputs:intensity = "x"'), "a finite number", "/L"),
    "colour": (light("RectLight", "color3f inputs:color = (nan, 1, 1)"), "3 finite numbers", "/L"),
    "exposure": (light("RectLight", "float inputs:exposure = 3000"), "inputs:exposure 3000", "/L"),
    "old": (light("RectLight", "float intensity = 5"), "inputs:intensity, as USD has it since 21.02", "/L"),
    "camera": ('def RenderSettings "A" {\nrel camera = </Gone>\n}\n', "camera /Gone", "/A"),
    "curves": ('def BasisCurves "B" {\n}\n', "BasisCurves", "/B"),
    "glow": (f'def Mesh "M" (prepend apiSchemas = ["MeshLightAPI"]) {{\n{MESH}}}\n', "materialGlowTintsLight", "/M"),
    "ellipse": (light("DiskLight", MIRROR.replace("-1, 1", "2, 1")), "ellipse", "/L"),
    "no material": (preview().replace("</M>", "</Gone>"), "material:binding </Gone>", "/S"),
    "shader": (preview().replace("UsdPreviewSurface", "Metal"), "--as-diffuse", "/M"),
    "varying": (
        f'def Mesh "M" {{\n{MESH}color3f[] primvars:displayColor = [(1,1,1), (0,0,0)]\n}}\n',
        "one colour",
        "/M",
    ),
    "index": (f'def Mesh "M" {{\n{MESH.replace("2, 3", "2, 7")}}}\n', "face 0 index", "/M"),
}


@needs_usd
def test_a_colour_temperature_multiplies_a_colour(tmp_path):
    """As UsdLux's own function has it; alone it is none."""
    on, warm, cold = (
        "bool inputs:enableColorTemperature = 1",
        "float inputs:colorTemperature = 3000",
        "color3f inputs:color = (1, 0, 1)",
    )
    told = ("\n".join(words) for words in ((warm,), (on, warm), (on, warm, cold)))
    none, some, both = (read(tmp_path, light("RectLight", words)).lights[0].colour for words in told)
    assert none[0] == none[1] == none[2]
    assert some[0] > 1.5 * none[0]
    assert some[2] < 0.5 * none[2]
    assert both == pytest.approx((some[0], 0.0, some[2]))


@needs_usd
def test_a_colour_may_be_said_above_a_mesh_and_by_index(tmp_path):
    above = 'color3f[] primvars:displayColor = [(0.5, 0.25, 0)] (interpolation = "constant")\n'
    made = read(tmp_path, f'def Xform "X" {{\n{above}def Mesh "M" {{\n{MESH}}}\n}}\n')
    assert made.meshes[0].material.diffuse == (0.5, 0.25, 0)
    indexed = "color3f[] primvars:displayColor = [(1, 1, 1), (0, 0, 0.5)]\nint[] primvars:displayColor:indices = [1]\n"
    made = read(tmp_path, f'def Mesh "M" {{\n{MESH}{indexed}float[] primvars:displayOpacity = [0.5]\n}}\n')
    assert made.meshes[0].material.diffuse == (0, 0, 0.5)
    assert any("displayOpacity is left out" in note for note in made.warnings)


@needs_usd
def test_the_camera_is_that_of_the_settings_and_these_those_of_the_stage(tmp_path):
    other = CAMERA.replace("Eye", "Other").replace("(0, 0, 5)", "(0, 0, 9)")
    chosen = 'def RenderSettings "Chosen" {\nuniform int2 resolution = (8, 6)\nrel camera = </Other>\n}\n'
    made = read(
        tmp_path, light("RectLight"), f'(\nrenderSettingsPrimPath = "/Chosen"\n)\n{CAMERA}{other}{SETTINGS}{chosen}'
    )
    assert (made.camera.position, made.width) == ((0, 0, 9), 8)
    assert any("/Eye: is left out: /Other is the camera" in note for note in made.warnings)


@pytest.mark.parametrize("name", REFUSED)
@needs_usd
def test_others_are_refused_by_prim(tmp_path, name):
    text, words, place = REFUSED[name]
    with pytest.raises(InputError, match=words) as told:
        read(tmp_path, text, CAMERA if name == "camera" else CAMERA + SETTINGS)
    assert str(told.value).startswith(f"{tmp_path}/a.usda:{place}")


@needs_usd
def test_what_is_no_stage_is_refused(tmp_path):
    (tmp_path / "a.usda").write_text("#usda 1.0\ndef Xform {")
    with pytest.raises(InputError, match=r"what usd-core opens: \S*a\.usda:\d+:\d+: ") as told:
        read_usd(tmp_path / "a.usda")
    assert "Error in" not in str(told.value)
    (tmp_path / "a.usda").write_bytes(b'#usda 1.0\ndef Xform "\x8d" {\n}\n')
    with pytest.raises(InputError, match="what usd-core opens"):
        read_usd(tmp_path / "a.usda")
    with pytest.raises(InputError, match="one UsdGeomCamera"):
        read(tmp_path, "", head="")
    crop = CAMERA.replace("{", "{\nfloat horizontalApertureOffset = 1", 1)
    with pytest.raises(InputError, match="straight ahead"):
        read(tmp_path, "", head=crop + SETTINGS)
