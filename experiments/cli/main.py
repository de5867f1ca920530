"""The command `nusselt`."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NoReturn

import click
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from nusselt.experiments.results.document import EXIT
from nusselt.experiments.runs.workers import WorkerLost
from nusselt.experiments.scenes import catalogue
from nusselt.experiments.terminal.options import cluster_option, export_options, reporting_options, sampling_options
from nusselt.renderer.errors import InputError

from .external_commands import reference, trial_estimator
from .external_options import bring_options

ERRORS = Console(stderr=True, highlight=False)
Report = Callable[[str, int, int], None]


class Group(click.Group):
    """Turns what a user got wrong into one line and exit status 2, whatever the command."""

    def invoke(self, context: click.Context) -> Any:
        try:
            return super().invoke(context)
        except InputError as error:
            stop(str(error), EXIT["bad input"])
        except WorkerLost as error:
            stop(str(error), EXIT["not as claimed"])
        except KeyboardInterrupt:
            stop("interrupted: what was finished is written", 130)


def stop(message: str, status: int) -> NoReturn:
    """One line on standard error, and out."""
    click.echo(f"nusselt: {message}", err=True)
    sys.exit(status)


@contextmanager
def progress_bar(title: str) -> Iterator[Report]:
    """Progress with the time left, on a terminal only."""
    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        console=ERRORS,
        transient=True,
        disable=not ERRORS.is_terminal,
    )
    with bar:
        task = bar.add_task(title)

        def report(stage: str, done: int, total: int) -> None:
            bar.update(task, description=f"{title}: {stage}", completed=done, total=total)

        yield report


@click.group(cls=Group, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="nusselt")
def main() -> None:
    """Is a direct-lighting renderer right, and how sure are we?

    Exit status: 0 everything as claimed, 1 something not, 2 bad usage or input, 3 undecided, 4 the reference
    could not run.
    """


@main.command()
@click.argument("scenes", metavar="SCENE... [IMAGE...]", nargs=-1)
@click.option("--classic", is_flag=True, help="All classic scenes.")
@sampling_options
@bring_options
@click.option("--margin", type=float, default=1e-3, show_default=True, help="Relative bias that does not matter.")
@click.option("--alpha", type=float, default=1e-3, show_default=True, help="False-alarm rate of the whole report.")
@click.option("--timeout", type=float, default=600.0, show_default=True, help="Seconds for one reference.")
@click.option("--until-decided", is_flag=True, help="Add passes to undecided scenes; they are kept under --out.")
@click.option("--budget", type=float, default=600.0, show_default=True, help="Seconds for --until-decided.")
@click.option("--out", type=click.Path(path_type=Path), help="Folder for the pictures and results.json.")
@click.option("--json", "target", metavar="FILE|-", help="Write the results there ('-': standard output).")
@cluster_option
@export_options
def check(scenes: tuple[str, ...], classic: bool, **options: Any) -> None:
    """Compare our image of each SCENE with Mitsuba's: bias, RMS, their intervals, a verdict.

    \b
    nusselt check quad cornell --out out
    nusselt check my.test --samples 64 --margin 0.0005 --json -
    nusselt check quad-stratified mine-1.png mine-2.png
    nusselt check my.test --renderer "./mine {scene} {samples} {seed} {output}"

    With IMAGEs (.png, .exr, .pfm, .hdr, .npy) or a --renderer those are judged in place of ours.
    """
    from .check import run_check

    asked = catalogue.classic(options["estimator"]) if classic else []
    asked += [catalogue.Asked(name, options["estimator"]) for name in scenes]
    if options["until_decided"] and options["out"] is None:
        raise click.UsageError("--until-decided keeps its passes on disk: name a folder with --out")
    if not asked:
        raise click.UsageError("name a scene file, a classic scene (see: nusselt list), or --classic")
    sys.exit(run_check(asked, options, progress_bar))


@main.command()
@click.argument("scene")
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True, help="IMAGE.png, .exr or .npy")
@sampling_options
@cluster_option
@click.option("--error", type=float, help="Sample until the relative RMS error is at most this; see common-points.")
def render(scene: str, output: Path, error: float | None, **options: Any) -> None:
    """Our image of SCENE alone; needs no Mitsuba.

    \b
    nusselt render cornell --samples 25 --stratify -o cornell.png
    nusselt render mesh --error 1e-3 -o mesh.png
    """
    from .render import run_render

    run_render(scene, output, error, options, progress_bar)


@main.command()
@click.argument("scene")
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True, help="SCENE.xml")
@click.option("--lenient", is_flag=True, help="Warn of unknown commands instead of refusing the scene.")
@click.option("--two-sided", is_flag=True, help="Surfaces reflect at their back too.")
def export(scene: str, output: Path, lenient: bool, two_sided: bool) -> None:
    """Write SCENE as an equivalent Mitsuba scene (XML and PLY).

    A purely diffuse one loads in the stock `mitsuba` executable; a glossy one needs
    `python -m nusselt.mitsuba_bridge render SCENE.xml`, which registers the Phong surface first.
    """
    from nusselt.mitsuba_bridge.export import export_scene

    read = catalogue.load(scene, lenient).with_(two_sided=two_sided)
    for note in (*read.warnings, *export_scene(read, output)):
        click.echo(note, err=True)


@main.command()
@click.argument("names", metavar="NAME...|all", nargs=-1, required=True)
@click.option("--scenes", multiple=True, metavar="SCENE", help="Instead of the experiment's own; may be repeated.")
@reporting_options
@export_options
@cluster_option
def run(names: tuple[str, ...], scenes: tuple[str, ...], quick: bool, seed: int, **where: Any) -> None:
    """Run experiments; what is finished in the folder is not done again (see: nusselt list).

    \b
    nusselt run random-vs-stratified soft-shadows --out out
    nusselt run all --quick --out out
    """
    from nusselt.experiments.runs.experiment import Settings
    from nusselt.experiments.runs.run import Request, chosen, run_experiments
    from nusselt.experiments.studies.suite import EXPERIMENTS

    settings = Settings(quick, seed, tuple(scenes))
    sys.exit(run_experiments(chosen(names, EXPERIMENTS), Request(settings, **where), progress_bar))


@main.command()
@click.argument("cases", metavar="CASES.json...", nargs=-1)
@reporting_options
def stability(cases: tuple[str, ...], quick: bool, seed: int, **where: Any) -> None:
    """The closed forms on stiff and extreme cases, against values known to many digits.

    Without files: the project's own cases, and whole images against their scaled, moved or exact twins.

    \b
    nusselt stability --out out
    nusselt stability my-cases.json --json -
    """
    from nusselt.experiments.runs.experiment import Settings
    from nusselt.experiments.runs.run import Request

    from .stability import run_stability

    sys.exit(run_stability(cases, Request(Settings(quick, seed), **where), progress_bar))


@main.command()
def doctor() -> None:
    """Versions, variants, which LLVM and why; what is missing and the command that mends it."""
    from nusselt.experiments.results.document import machine, package_versions
    from nusselt.experiments.results.tables import console
    from nusselt.mitsuba_bridge.llvm import backend_report

    told = console()
    for name, value in machine().items():
        told.print(f"{name:20} {value}", markup=False)
    missing = []
    for package, version in package_versions().items():
        told.print(f"{package:20} {version or 'missing'}", markup=False)
        if version is None:
            missing.append(package)
    ready, lines = backend_report()
    for line in lines:
        told.print(line, markup=False)
    for package in missing:
        told.print(f"missing: {package}; mend with: pip install {package}", markup=False)
    sys.exit(EXIT["as claimed"] if ready else EXIT["no reference"])


@main.command()
@click.argument("folder", type=click.Path(path_type=Path), metavar="OUT")
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True, help="REPORT.html")
def report(folder: Path, output: Path) -> None:
    """One offline HTML file from the folder OUT alone: verdicts, images to flip through, figures.

    Exit status 1 where nothing was measured.

    \b
    nusselt check --classic --out out; nusselt report out -o report.html
    """
    from nusselt.experiments.results.report import write_report

    with progress_bar("report") as tell:
        rows = write_report(folder, output, tell)
    sys.exit(EXIT["as claimed" if rows else "not as claimed"])


@main.command()
@click.argument("baseline", type=click.Path(path_type=Path), metavar="BASELINE.json")
@click.argument("results", type=click.Path(path_type=Path), metavar="RESULTS.json")
@click.option("--alpha", type=float, default=1e-3, show_default=True, help="Family-wise false-alarm rate.")
def compare(baseline: Path, results: Path, alpha: float) -> None:
    """What changed between two runs beyond their noise; 1 where anything is worse or missing. Time is told alone.

    \b
    nusselt compare baseline.json out/results.json
    """
    from nusselt.experiments.results.compare import compare as compare_files

    found = compare_files(baseline, results, alpha)
    for line in found.lines():
        click.echo(line)
    sys.exit(found.status)


@main.command(name="list")
def list_command() -> None:
    """Scenes, estimators and experiments, one line each."""
    from nusselt.experiments.studies.suite import EXPERIMENTS
    from nusselt.renderer.estimators import ESTIMATORS

    click.echo("scenes")
    for name in (*catalogue.CLASSIC, *catalogue.GENERATED):
        click.echo(f"  {name:18} {catalogue.summary(name)}")
    click.echo("estimators")
    for kind in ESTIMATORS:
        click.echo(f"  {kind.name:18} {kind.summary}")
    click.echo("experiments")
    for experiment in EXPERIMENTS:
        click.echo(f"  {experiment.name:20} {experiment.summary}")


main.add_command(reference)
main.add_command(trial_estimator)
