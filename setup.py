"""The one import name, `nusselt`, over the source folders; all else is in pyproject.toml."""

from setuptools import find_packages, setup

FOLDERS = ("renderer", "mitsuba_bridge", "experiments")
FRONT = "experiments.nusselt"
"""What `import nusselt` runs: the package's own root."""

parts = [name for folder in FOLDERS for name in find_packages(include=[folder, f"{folder}.*"]) if name != FRONT]
setup(
    packages=["nusselt", *(f"nusselt.{name}" for name in parts)],
    package_dir={"nusselt": FRONT.replace(".", "/")} | {f"nusselt.{folder}": folder for folder in FOLDERS},
)
