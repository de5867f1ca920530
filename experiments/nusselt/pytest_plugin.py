"""A pytest plug-in: ``def test_mine(nusselt): nusselt.agrees("box.test", renderer=my_render, margin=0.01)``.

Nothing but pytest is imported until a test asks for the fixture: a run that does not pays nothing.
"""

from __future__ import annotations

import re
from collections.abc import Generator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from nusselt.experiments.front.answers import Results

PARTS = ".parts"
"""Folder, in the report's, of what each process found: merged at the end by the one that started them."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Where a report goes, and where references are kept."""
    group = parser.getgroup("nusselt", "is a renderer right")
    group.addoption("--nusselt-report", metavar="DIR", help="Keep results.json, pictures and report.html there.")
    group.addoption("--nusselt-cache", metavar="DIR", help="Keep references there, by content; else in pytest's cache.")


@dataclass
class _Kept:
    """What the tests of this process found, and where it goes.

    Parameters
    ----------
    report : Path or None
    cache : Path or None
    process : str
        Name of this process among those that run tests.
    rows : list of dict
    """

    report: Path | None
    cache: Path | None
    process: str
    rows: list[dict[str, Any]] = field(default_factory=list)

    def keep(self, results: Results, test: str) -> None:
        """Write what a test found: pictures to the report's folder, rows to this process's part."""
        if self.report is None:
            return
        for row, folder in results.write_pictures(self.report, _file_name(test)):
            self.rows.append({**row, "images": folder, "test": test, "command": f"pytest {test!r}"})
        _write(self.rows, self.report / PARTS / f"{self.process}.json")


_KEPT = pytest.StashKey[_Kept]()


def _file_name(test: str) -> str:
    return re.sub(r"[^\w.-]+", "-", test).strip("-.")


def _write(rows: list[dict[str, Any]], path: Path) -> None:
    from nusselt.experiments.results.document import document, write_json

    write_json(document(rows), str(path))


def _folder(config: pytest.Config, option: str) -> Path | None:
    value = config.getoption(option)
    return None if value is None else config.invocation_params.dir / value


def _check_folder(report: Path) -> None:
    from nusselt.experiments.files import check_place
    from nusselt.renderer.errors import InputError

    try:
        check_place("--nusselt-report", report, folder=True)
    except InputError as error:
        raise pytest.UsageError(str(error)) from None


def pytest_configure(config: pytest.Config) -> None:
    """Where this process puts things; what an earlier run left is no part of this one."""
    worker: str | None = getattr(config, "workerinput", {}).get("workerid")
    report, cache = _folder(config, "--nusselt-report"), _folder(config, "--nusselt-cache")
    if report is not None:
        _check_folder(report)
    config.stash[_KEPT] = _Kept(report, cache, worker or "main")
    if report is not None and worker is None:
        for part in (report / PARTS).glob("*.json"):
            part.unlink()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo[None]) -> Generator[None, Any, Any]:
    """What is wrong with a question is one line, as on the command line, and no page of source."""
    report = yield
    if call.excinfo is not None and isinstance(getattr(item, "funcargs", {}).get("nusselt"), Checks):
        from nusselt.experiments.external.program import ProgramFailed
        from nusselt.renderer.errors import InputError

        if isinstance(call.excinfo.value, (InputError, ProgramFailed)):
            report.longrepr = f"{call.excinfo.typename}: {call.excinfo.value}"
    return report


@pytest.hookimpl(trylast=True)
def pytest_sessionfinish(session: pytest.Session) -> None:
    """Merge the parts of all processes into one report."""
    kept = session.config.stash[_KEPT]
    if kept.report is None or kept.process != "main":
        return
    parts = sorted((kept.report / PARTS).glob("*.json"))
    if not parts:
        return
    from nusselt.experiments.results.document import read_json
    from nusselt.experiments.results.report import write_report

    rows = sorted((row for part in parts for row in read_json(part)["rows"]), key=lambda row: str(row["command"]))
    _write(rows, kept.report / "results.json")
    for part in parts:
        part.unlink()
    (kept.report / PARTS).rmdir()
    write_report(kept.report, kept.report / "report.html")


def pytest_terminal_summary(terminalreporter: Any, config: pytest.Config) -> None:
    """Where the report is."""
    report = config.stash[_KEPT].report
    if report is not None:
        made = (report / "report.html").exists()
        terminalreporter.write_line(f"nusselt: {report / 'report.html' if made else 'no report: nothing was checked'}")


@dataclass(frozen=True)
class Checks:
    """The fixture: `nusselt.check` for one test, references kept between runs."""

    kept: _Kept
    test: str

    def check(self, *scenes: Any, **asked: Any) -> Results:
        """`nusselt.check`, kept for the report; the test looks at the results itself.

        A renderer is run at one number of samples unless ``steps`` says otherwise: its order is no part of a verdict.
        """
        __tracebackhide__ = True
        import nusselt

        if asked.get("renderer") is not None:
            asked.setdefault("steps", 1)
        if self.kept.cache is not None:
            asked.setdefault("cache", self.kept.cache)
        results = nusselt.check(*scenes, **asked)
        self.kept.keep(results, self.test)
        return results

    def agrees(self, *scenes: Any, **asked: Any) -> Results:
        """Fail the test unless every row agrees, with what the verdict says and what mistake it looks like."""
        __tracebackhide__ = True
        results = self.check(*scenes, **asked)
        if not results.agrees:
            pytest.fail(str(results), pytrace=False)
        return results


@pytest.fixture(name="nusselt")
def _checks(request: pytest.FixtureRequest) -> Checks:
    """Judge renderers in a test: ``nusselt.agrees(scene, renderer=..., margin=...)``."""
    kept = request.config.stash[_KEPT]
    cache = getattr(request.config, "cache", None)
    if kept.cache is None and cache is not None:
        kept.cache = cache.mkdir("nusselt")
    return Checks(kept, request.node.nodeid)
