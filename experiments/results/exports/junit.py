"""JUnit XML: a test case a row, so that a forge lists them as it lists tests."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any
from xml.etree import ElementTree

from nusselt.experiments.results.rows import experiment_of, method, status
from nusselt.experiments.results.work_precision import seconds_of

FORBIDDEN = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""What XML 1.0 cannot hold, even escaped."""


def _clean(value: Any) -> str:
    return FORBIDDEN.sub("�", str(value))


class _Suite:
    """Test cases as they are added."""

    def __init__(self) -> None:
        self.element = ElementTree.Element("testsuite", name="nusselt")

    def add(
        self, classname: str, name: str, told: tuple[str, Any, Any] = ("", "", ""), seconds: float | None = None
    ) -> None:
        """A case: "failure", "skipped" or nothing, why, and a command that makes it again."""
        tag, why, command = told
        time = {} if seconds is None else {"time": f"{seconds:.3f}"}
        case = ElementTree.SubElement(self.element, "testcase", {"classname": classname, "name": _clean(name), **time})
        if tag:
            ElementTree.SubElement(case, tag, message=_clean(why)).text = _clean(command)

    def document(self) -> str:
        """All of it, counted."""
        counts = {"failures": "*/failure", "errors": "*/error", "skipped": "*/skipped"}
        for name, path in counts.items():
            self.element.set(name, str(len(self.element.findall(path))))
        self.element.set("tests", str(max(len(self.element), 1)))
        ElementTree.indent(self.element)
        body = ElementTree.tostring(self.element, encoding="unicode")
        return f'<?xml version="1.0" encoding="UTF-8"?>\n{body}\n'


def junit(document: dict[str, Any]) -> str:
    """A results document as JUnit XML: not as claimed is a failure, undecided a skipped case, no rows a failure."""
    suite, tags = _Suite(), {"failing": "failure", "undecided": "skipped"}
    rows = [row for row in document["rows"] if status(row) != "shown"]
    for row in rows:
        told = tags.get(status(row), ""), row.get("reason") or row.get("verdict") or "", row.get("command") or ""
        name = f"{row.get('scene') or ''} {method(row)}".strip()
        suite.add(_clean(f"nusselt.{experiment_of(row)}"), name, told, seconds_of(row) or 0.0)
    if not rows:
        suite.add("nusselt", "rows", ("failure", "nothing was measured: there is no row to judge", ""))
    return suite.document()


def junit_of(classname: str, cases: Mapping[str, tuple[str, str, str]]) -> str:
    """Cases by their names, each "failure", "skipped" or nothing, with why, and a command that makes it again."""
    suite = _Suite()
    for name, told in cases.items():
        suite.add(classname, name, told)
    return suite.document()
