"""Pages that need nothing beside them: templates with every name escaped, and the house's style."""

from __future__ import annotations

from importlib import resources

from jinja2 import Environment, PackageLoader, Template

from nusselt.experiments.results.rows import percent
from nusselt.renderer.words import count


def template(name: str) -> Template:
    """A page's template of this folder, with the filters ``percent`` and ``count``."""
    loader = PackageLoader("nusselt.experiments.results.report", "")
    environment = Environment(loader=loader, autoescape=True, trim_blocks=True, lstrip_blocks=True)
    environment.filters |= {"percent": percent, "count": count}
    return environment.get_template(name)


def asset(name: str) -> str:
    """A style sheet or script of this folder."""
    return resources.files(__package__).joinpath(name).read_text(encoding="utf-8").strip()
