"""JUnit XML: a test case a row, so that a forge lists them as it lists tests."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any
from xml.etree import ElementTree

from nusselt.experiments.results.rows import experiment_of, method, status
from nusselt.experiments.results.schema import Row
from nusselt.experiments.results.summary import counted
from nusselt.experiments.results.work_precision import seconds_of

FORBIDDEN = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""What XML 1.0 cannot hold, even escaped."""


def _clean(value: Any) -> str:
    return FORBIDDEN.sub("�", str(value))


def _suite(tests: int, failures: int, skipped: int) -> ElementTree.Element:
    counts = {"tests": str(max(tests, 1)), "failures": str(failures), "errors": "0", "skipped": str(skipped)}
    return ElementTree.Element("testsuite", {"name": "nusselt", **counts})


def _document(suite: ElementTree.Element) -> str:
    ElementTree.indent(suite)
    body = ElementTree.tostring(suite, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{body}\n'


def junit(document: dict[str, Any]) -> str:
    """A results document as JUnit XML: not as claimed is a failure, undecided a skipped case, no rows a failure."""
    rows = [row for row in document["rows"] if status(row) != "shown"]
    by = counted(rows)
    suite = _suite(len(rows), by["failing"] if rows else 1, by["undecided"])
    for row in rows:
        _case(suite, row)
    if not rows:
        case = ElementTree.SubElement(suite, "testcase", classname="nusselt", name="rows")
        ElementTree.SubElement(case, "failure", message="nothing was measured: there is no row to judge")
    return _document(suite)


def junit_of(classname: str, cases: Mapping[str, tuple[str, str, str]]) -> str:
    """Cases by their names, each "failure", "skipped" or nothing, with why, and a command that makes it again."""
    tags = [tag for tag, _, _ in cases.values()]
    suite = _suite(len(cases), tags.count("failure"), tags.count("skipped"))
    for name, (tag, why, command) in cases.items():
        case = ElementTree.SubElement(suite, "testcase", classname=classname, name=_clean(name))
        if tag:
            ElementTree.SubElement(case, tag, message=_clean(why)).text = _clean(command)
    return _document(suite)


def _case(suite: ElementTree.Element, row: Row) -> None:
    case = ElementTree.SubElement(
        suite,
        "testcase",
        classname=_clean(f"nusselt.{experiment_of(row)}"),
        name=_clean(f"{row.get('scene') or ''} {method(row)}".strip()),
        time=f"{seconds_of(row) or 0:.3f}",
    )
    tag = {"failing": "failure", "undecided": "skipped"}.get(status(row))
    if tag:
        told = ElementTree.SubElement(case, tag, message=_clean(row.get("reason") or row.get("verdict") or ""))
        told.text = _clean(row.get("command") or "")
