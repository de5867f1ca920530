"""Results as small pieces of HTML, with every name escaped: what a notebook shows of them."""

from __future__ import annotations

import base64
import io
from typing import Any

import numpy as np
from markupsafe import Markup

from nusselt.experiments.images.formats.png import to_levels
from nusselt.experiments.verdict.judge import standard_errors
from nusselt.mitsuba_bridge.reference import Reference
from nusselt.renderer.image import Image

from .columns import COLUMNS
from .pictures import RANGE, colour_difference
from .rows import method, whose
from .schema import Row
from .summary import headline


def results_html(document: dict[str, Any]) -> str:
    """The verdict on all rows, and a line each."""
    head = Markup("").join(Markup("<th>{}</th>").format(column.name) for column in COLUMNS)
    lines = [[Markup("<td>{}</td>").format(column.shown(row)) for column in COLUMNS] for row in document["rows"]]
    body = Markup("").join(Markup("<tr>{}</tr>").format(Markup("").join(line)) for line in lines)
    said = headline(document["rows"])[1]
    return str(Markup("<p><b>{}</b></p><table><thead><tr>{}</tr></thead>{}</table>").format(said, head, body))


def _picture(levels: np.ndarray[Any, Any], words: str) -> Markup:
    from PIL import Image

    stream = io.BytesIO()
    Image.fromarray(levels).save(stream, "PNG")
    source = "data:image/png;base64," + base64.b64encode(stream.getvalue()).decode()
    image = Markup('<img src="{}" alt="{}" width="280">').format(source, words)
    figure = Markup('<figure style="display:inline-block">{}<figcaption>{}</figcaption></figure>')
    return figure.format(image, words)


def answer_html(row: Row, ours: Image, reference: Reference | None) -> str:
    """A row's verdict and reason over ours, the reference and their difference in standard errors."""
    shown = [_picture(to_levels(ours.first).transpose(1, 2, 0), f"{whose(row)}, one image")]
    if reference is not None:
        z = standard_errors(ours, reference, row["passes"])
        shown.append(_picture(to_levels(reference.mean).transpose(1, 2, 0), "reference"))
        shown.append(_picture(colour_difference(z), f"difference, ±{RANGE:g} standard errors"))
    told = Markup("<p><b>{} {}: {}</b> {}</p>").format(row["scene"], method(row), row["verdict"], row["reason"])
    return str(told + Markup("").join(shown))
