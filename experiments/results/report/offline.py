"""Pages that need nothing beside them: templates with every name escaped, and the house's style."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Mapping, Sequence
from importlib import resources
from typing import Any

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


def scripted(page: str, scripts: Sequence[str], content: Mapping[str, Any]) -> str:
    """A page of this folder as text, with its style, and these scripts and no others allowed to run."""
    script = "\n".join(map(asset, scripts))
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    return template(page).render(**content, style=asset("style.css"), script=script, script_digest=digest)
