"""Peers: what each says of itself, how it is had and run, and that those that are there agree with the exact image."""

import ast
import json
import sys
from dataclasses import replace

import numpy as np
import pytest
from builders import floor, lamp, scene
from click.testing import CliRunner

from nusselt.experiments.cli.main import main
from nusselt.experiments.external.program import ProgramFailed
from nusselt.experiments.images.write import write_image
from nusselt.experiments.peers.cross import CrossQuestion, cross_check
from nusselt.experiments.peers.description import HALF, describe
from nusselt.experiments.peers.entrant import Effort, of_peer
from nusselt.experiments.peers.environment import Environments, default_folder, packages_for
from nusselt.experiments.peers.peer import OnPath
from nusselt.experiments.peers.renderer import PeerRenderer, renderer_of
from nusselt.experiments.peers.renderers import PEERS, peer_of
from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import Exact
from nusselt.renderer.image import render
from nusselt.renderer.lights import PointLight
from nusselt.renderer.scene_text import write_scene
from nusselt.renderer.surfaces import Ellipsoid, Material

BALL = Ellipsoid.sphere((0.6, 0.4, 0.3), 0.4, Material((0.2, 0.4, 0.6)))
SMALL = scene(floor(), lights=(lamp(),)).with_(ellipsoids=(BALL,), width=40, height=30, two_sided=True)
"""Wider than high, with a ball that stands off the axis: what is mirrored, turned or too wide shows."""
SHINY = Material((0.3, 0.2, 0.1), (0.3, 0.4, 0.5), 6.0)
GLOSSY = SMALL.with_(meshes=(floor(material=SHINY),), ellipsoids=(replace(BALL, material=SHINY),))
HERE = Environments(default_folder())


def options_of(peer):
    """Names that an adapter's render takes; of what the bridge runs, those that it reads."""
    if peer.within:
        return {"sampler"}
    tree = ast.parse(peer.adapter.read_text(encoding="utf-8"))
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef) and node.name == "render":
            found |= {argument.arg for argument in node.args.args}
        if isinstance(node, ast.AnnAssign) and getattr(node.target, "id", "") == "DEFAULTS":
            found |= {key.value for key in node.value.keys}
    return found


@pytest.mark.parametrize("peer", PEERS, ids=lambda peer: peer.name)
def test_every_peer_says_what_it_is(peer):
    assert peer.licence
    assert peer.unequal
    assert peer.packages or peer.program or peer.within
    assert all("==" in name for names in peer.packages.values() for name in names)
    assert peer.settings
    assert len({setting.left for setting in peer.settings}) == len(peer.settings)
    for setting in peer.settings:
        assert setting.options.keys() <= options_of(peer), setting.what


@pytest.mark.parametrize("peer", PEERS, ids=lambda peer: peer.name)
def test_peers_that_are_there_agree_with_the_exact_image(peer):
    """At 1e-6: nothing speaks against them, a mistake of the adapter of 5 % of any pixel would."""
    launch = HERE.launch(peer)
    if launch is None:
        pytest.skip(f"{peer.title} is not there: {HERE.status(peer)}")
    with renderer_of(peer, launch, SMALL) as renderer:
        entrant = of_peer(renderer, Effort(seeds=2, samples=64))
    found = cross_check(SMALL, [entrant], CrossQuestion(margin=1e-3, alpha=1e-6))
    assert found.exact[peer.name].word != "differs", found.exact[peer.name].reason
    if not peer.noise:
        assert found.exact[peer.name].word == "agrees"


def test_a_description_is_the_scene_near_the_origin():
    told = describe(SMALL)
    places = np.concatenate([told["corners"].reshape(-1, 3), told["position"][None]])
    assert HALF <= np.abs(places).max() < 2 * HALF
    moved = describe(
        SMALL.with_(
            camera=replace(SMALL.camera, position=(1000.0, 3.0, 6.0), target=(1000.0, 0.0, 0.0)),
            meshes=tuple(
                replace(mesh, vertices=mesh.vertices + np.array([[1000.0], [0], [0]])) for mesh in SMALL.meshes
            ),
            ellipsoids=tuple(replace(ball, center=(1000.6, 0.4, 0.3)) for ball in SMALL.ellipsoids),
            lights=tuple(replace(x, corner=(x.corner[0] + 1000, *x.corner[1:])) for x in SMALL.lights),
        )
    )
    for name, values in told.items():
        np.testing.assert_allclose(moved[name], values, atol=1e-12, err_msg=name)


@pytest.mark.parametrize(
    "change",
    [
        {"lights": (PointLight((0.0, 3.0, 0.0), (1.0, 1.0, 1.0)),)},
        {"meshes": (floor(material=Material((0.5, 0.5, 0.5), emission=(0.2, 0.2, 0.2))),)},
        {"ellipsoids": (Ellipsoid((0.0, 1.0, 0.0), ((1.0, 0, 0), (0, 2.0, 0), (0, 0, 1.0))),)},
    ],
    ids=["light", "material", "ellipsoid"],
)
def test_what_peers_do_not_have_is_refused(change):
    with pytest.raises(InputError, match=r"peers? ha"):
        describe(SMALL.with_(**change))


@pytest.mark.parametrize("peer", PEERS, ids=lambda peer: peer.name)
def test_glossy_scenes_are_shown_right_or_refused_by_name(peer):
    """A Phong lobe is nobody's default: of other lobes no image is made."""
    launch = HERE.launch(peer)
    if peer.gloss:
        with pytest.raises(InputError, match=peer.title) as told, renderer_of(peer, ["none"], GLOSSY):
            pass
        assert peer.gloss in str(told.value)
    elif launch is None:
        pytest.skip(f"{peer.title} is not there: {HERE.status(peer)}")
    else:
        with renderer_of(peer, launch, GLOSSY) as renderer:
            entrant = of_peer(renderer, Effort(seeds=2, samples=64))
        found = cross_check(GLOSSY, [entrant], CrossQuestion(margin=1e-3, alpha=1e-6))
        assert found.exact[peer.name].word != "differs", found.exact[peer.name].reason


def test_a_peer_that_fails_is_told_in_a_sentence(tmp_path):
    scripts = {
        "fails": "import sys; sys.exit('no licence')",
        "nothing": "",
        "garbage": "import sys; open(sys.argv[-2], 'wb').write(b'PK')",
        "small": "import sys, numpy as np; np.savez(sys.argv[-2], image=np.zeros((2, 2, 3)), version='1')",
    }
    for name, text in scripts.items():
        script = tmp_path / f"{name}.py"
        script.write_text(text)
        with PeerRenderer(peer_of("radiance"), [sys.executable, str(script)], SMALL) as renderer:
            with pytest.raises(ProgramFailed, match=renderer.peer.title) as told:
                renderer.run(16, 0)
            assert "\n" not in str(told.value)


def test_environments_are_found_and_packages_chosen(tmp_path):
    peer = replace(peer_of("cycles"), program=None)
    environments = Environments(tmp_path)
    assert environments.launch(peer) is None
    assert environments.status(peer) == "nusselt peers install cycles"
    assert packages_for(peer, "3.11") == ["bpy==5.0.1"]
    with pytest.raises(InputError, match=r"Python 3\.11 or 3\.13"):
        packages_for(peer, "3.12")
    with pytest.raises(InputError, match="povray"):
        packages_for(peer_of("povray"), "3.11")
    found = environments.launch(replace(peer, program=OnPath("sh", "", ("--python",))))
    assert found is not None
    assert found[1:] == ["--python", str(peer.adapter), "--"]


def test_missing_peers_are_named_and_the_others_compared(tmp_path):
    """With no peer at all, brought images are still judged; the page needs nothing beside it."""
    source, image = tmp_path / "mine.test", tmp_path / "mine.npy"
    source.write_text(write_scene(SMALL), encoding="utf-8")
    write_image(image, render(SMALL, Exact()).mean)
    words = [
        "cross",
        str(source),
        str(image),
        "--two-sided",
        "--peers",
        "embree,luxcore",
        "--out",
        str(tmp_path / "out"),
    ]
    done = CliRunner().invoke(main, [*words, "--environments", str(tmp_path)])
    assert done.exit_code == 0, done.output
    assert "without embree: not installed: nusselt peers install embree" in done.output
    assert "yours agrees with the exact image" in done.output
    (row,) = json.loads((tmp_path / "out" / "results.json").read_text())["rows"]
    assert row["verdict"] == "agrees"
    page = (tmp_path / "out" / "cross.html").read_text(encoding="utf-8")
    assert page.count("without embree") == 1
    assert "MDB, %" in page
    assert "http" not in page.replace("http-equiv", "")
    alone = CliRunner().invoke(
        main, ["cross", str(source), "--two-sided", "--peers", "embree", "--environments", str(tmp_path)]
    )
    assert alone.exit_code == 2
    assert "nusselt peers install embree" in alone.output


def test_backs_that_peers_would_light_are_refused(tmp_path):
    """Ours are black there, unless the scene says otherwise."""
    source = tmp_path / "below.test"
    camera = replace(SMALL.camera, position=(0.0, -3.0, 6.0))
    source.write_text(write_scene(SMALL.with_(camera=camera, two_sided=False)), encoding="utf-8")
    image = tmp_path / "mine.npy"
    write_image(image, np.zeros((3, 30, 40)))
    done = CliRunner().invoke(main, ["cross", str(source), str(image), "--peers", "embree"])
    assert done.exit_code == 2
    assert "--two-sided" in done.output
