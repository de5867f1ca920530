"""The wheel beside a project with packages of the same folder names: both work, and each can go alone."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path

import pytest
from places import ROOT

pytestmark = pytest.mark.slow

ROOT = ROOT
LEFT_OUT = ("cornell.png",)
"""What only the README shows."""
FOLDERS = ("renderer", "mitsuba_bridge", "experiments")
PROJECT = {
    "renderer/__init__.py": "WHOSE = 'theirs'\n",
    "experiments/__init__.py": "from renderer import WHOSE\n",
    "tests/__init__.py": "",
    "tests/test_theirs.py": """
from dataclasses import dataclass
from typing import ClassVar
import experiments
import renderer
from nusselt.renderer.estimators import Area

@dataclass(frozen=True, kw_only=True)
class Mine(Area):
    name: ClassVar[str] = "mine"

def test_theirs():
    assert experiments.WHOSE == renderer.WHOSE == "theirs"

def test_ours(nusselt):
    nusselt.agrees("room.test", renderer=render, samples=16, margin=0.1)

def render(scene, samples, seed):
    import nusselt
    return nusselt.render(scene, estimator=Mine, samples=samples, seed=seed).array
""",
    "room.test": """size 24 18
camera 0 1.5 4 0 0 0 0 1 0 40
integrator direct
vertex -2 0 2
vertex 2 0 2
vertex 2 0 -2
vertex -2 0 -2
diffuse .5 .4 .3
tri 0 1 2
tri 0 2 3
quadLight -.5 3 -.5 0 0 1 1 0 0 5 5 5
""",
    "pyproject.toml": """
[build-system]
requires = ["setuptools"]
build-backend = "setuptools.build_meta"
[project]
name = "their-renderer"
version = "1"
[tool.setuptools]
packages = ["renderer", "experiments", "tests"]
""",
}


def call(*words: object, **options) -> str:
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, check=False, **options)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def built(tmp_path_factory) -> Path:
    """The wheel, built from a copy: the source folder is left as it is."""
    source, out = tmp_path_factory.mktemp("source") / "nusselt", tmp_path_factory.mktemp("wheel")
    source.mkdir()
    for name in (*FOLDERS, "setup.py", "pyproject.toml", "README.md", "LICENSE"):
        path = ROOT / name
        if path.is_dir():
            shutil.copytree(path, source / name, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            shutil.copy(path, source)
    pip("wheel", "--no-deps", "--no-build-isolation", "-w", out, source)
    (wheel,) = out.glob("*.whl")
    return wheel


def pip(*words: object, python: object = sys.executable) -> None:
    quiet = ("-m", "pip", "--disable-pip-version-check", "--no-input", "-q")
    call(python, *quiet, *words, env=without_links())


def without_links() -> dict[str, str]:
    """The environment without the source tree on the path."""
    return {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}


def test_the_wheel_holds_every_file_of_the_source_under_one_name(built):
    names = {name for name in zipfile.ZipFile(built).namelist() if ".dist-info/" not in name}
    assert {name.partition("/")[0] for name in names} == {"nusselt"}
    front = ROOT / "experiments" / "nusselt"
    wanted = {f"nusselt/{path.name}" for path in front.iterdir() if path.is_file()}
    for folder in FOLDERS:
        for path in (ROOT / folder).rglob("*"):
            ours = path.is_file() and "__pycache__" not in path.parts and path.name not in LEFT_OUT
            if ours and front not in path.parents:
                wanted.add(f"nusselt/{path.relative_to(ROOT).as_posix()}")
    assert names == wanted


@pytest.fixture(scope="module")
def place(built, tmp_path_factory) -> tuple[Path, Path]:
    """An environment with the wheel and a stranger's package, and the stranger's project; dependencies are lent."""
    venv, project = tmp_path_factory.mktemp("venv"), tmp_path_factory.mktemp("project")
    call(sys.executable, "-m", "venv", "--without-pip", venv)
    python = venv / "bin" / "python"
    lent = venv / "lent"
    lent.mkdir()
    for entry in Path(sysconfig.get_path("purelib")).iterdir():
        if "nusselt" not in entry.name and entry.suffix not in (".pth", ".egg-link"):
            (lent / entry.name).symlink_to(entry)
    home = Path(call(python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))").strip())
    (home / "lent.pth").write_text(f"{lent}\n")
    for name, text in PROJECT.items():
        (project / name).parent.mkdir(parents=True, exist_ok=True)
        (project / name).write_text(text)
    pip("install", "--no-deps", "--no-compile", built, python=python)
    pip("install", "--no-deps", "--no-compile", "--no-build-isolation", project, python=python)
    return python, project


def inside(place: tuple[Path, Path], *words: object) -> str:
    python, project = place
    return call(*words, cwd=project, env=without_links() | {"PATH": f"{python.parent}{os.pathsep}{os.environ['PATH']}"})


def test_command_python_and_pytest_work_inside_the_project(place):
    python, project = place
    module = "tests.test_theirs:Mine"
    inside(place, "nusselt", "render", "room.test", "--estimator", module, "-o", "mine-1.npy")
    inside(place, "nusselt", "render", "room.test", "--estimator", module, "--seed", 1, "-o", "mine-2.npy")
    inside(place, "nusselt", "check", "room.test", "mine-1.npy", "mine-2.npy", "--margin", 0.9, "--json", "out.json")
    assert json.loads((project / "out.json").read_text())["rows"][0]["verdict"] == "agrees"
    code = (
        "import nusselt, renderer, experiments, pathlib\n"
        "assert renderer.WHOSE == experiments.WHOSE == 'theirs'\n"
        "assert pathlib.Path(nusselt.__file__).is_relative_to(pathlib.Path(__import__('sys').prefix))\n"
        "print(nusselt.render('room.test', estimator='exact').array.max() > 0)"
    )
    assert inside(place, python, "-c", code).strip() == "True"
    assert "2 passed" in inside(place, python, "-m", "pytest", "-p", "no:cacheprovider", "--nusselt-report", "report")
    assert (project / "report" / "report.html").exists()


def test_each_can_go_alone(place):
    """Theirs, put back, and ours: what is left imports."""
    python, project = place
    elsewhere = project / "elsewhere"
    elsewhere.mkdir()
    pip("uninstall", "-y", "their-renderer", python=python)
    call(python, "-c", "import nusselt.experiments.cli.check", cwd=elsewhere, env=without_links())
    pip("install", "--no-deps", "--no-compile", "--no-build-isolation", project, python=python)
    pip("uninstall", "-y", "nusselt", python=python)
    call(python, "-c", "import renderer", cwd=elsewhere, env=without_links())
