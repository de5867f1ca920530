"""A hunt's page, offline like the others, and its scenes as files."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from nusselt.experiments.files import replacing
from nusselt.experiments.results.report.offline import asset, template
from nusselt.renderer.scene_text import write_scene
from nusselt.renderer.words import count

from .causes import Cause
from .hunt import Hunt


def headline(hunt: Hunt) -> str:
    """How many causes, in how many scenes."""
    words = Counter(entry.get("verdict", "waiting") for entry in hunt.scenes.values())
    rest = ", ".join(f"{number} {word}" for word, number in words.most_common())
    causes = count(len(hunt.causes.known), "distinct cause") if hunt.causes.known else "nothing wrong was found"
    return f"{causes} in {count(len(hunt.scenes), 'scene')} ({rest})"


def title(cause: Cause) -> str:
    """A cause in a line."""
    names = f": {' or '.join(cause.failing.names)}" if cause.failing.names else ""
    return f"{cause.failing.manner}{names} ({', '.join(cause.needs)})"


def scene_file(number: int) -> str:
    """Name of a cause's smallest scene."""
    return f"cause-{number + 1}.test"


def lines(hunt: Hunt) -> list[str]:
    """All causes, a line each, and the hunt's number."""
    told = [
        f"{title(cause)}, in {count(len(cause.seen), 'scene')}: {scene_file(number)}"
        for number, cause in enumerate(hunt.causes.known)
    ]
    return [*told, f"number {hunt.number[:16]}"]


def write_page(hunt: Hunt, commands: Sequence[str], command: str) -> None:
    """Write hunt.html and, for every cause, its scene with a command that shows it."""
    for number, (cause, again) in enumerate(zip(hunt.causes.known, commands, strict=True)):
        with replacing(hunt.place / scene_file(number)) as beside:
            said = f"# {title(cause)}: {cause.failing.reason}".replace("\n", " ")
            beside.write_text(f"{said}\n# {again}\n\n{write_scene(cause.scene)}", encoding="utf-8")
    question = hunt.question
    html = template("hunt.html").render(
        headline=headline(hunt),
        tone="bad" if hunt.causes.known else "good",
        causes=list(zip(map(title, hunt.causes.known), hunt.causes.known, commands, strict=True)),
        source=hunt.source.name,
        question=question,
        asking=question.asking,
        number=hunt.number,
        command=command,
        style=asset("style.css"),
    )
    with replacing(hunt.place / "hunt.html") as beside:
        beside.write_text(html, encoding="utf-8")
