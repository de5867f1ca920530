"""The command `nusselt`: one file a command, read when it is asked for."""

from __future__ import annotations

import ast
from importlib import import_module
from pathlib import Path

import click

from nusselt.experiments.terminal.group import Group

COMMANDS = (
    *("check", "render", "export", "run", "stability", "doctor", "report", "compare", "diff", "list"),
    *("reference", "test-estimator", "sensors", "peers", "cross", "metamorphic", "reduce", "hunt"),
)
"""Each is ``command`` of the file of its name: to add one, write the file and name it here."""


class Commands(Group):
    """The commands above, each imported when it is used: `nusselt --version` waits for no library."""

    def list_commands(self, context: click.Context) -> list[str]:
        """Their names, in order."""
        return list(COMMANDS)

    def get_command(self, context: click.Context, name: str) -> click.Command | None:
        """One of them; None if there is none of that name."""
        if name not in COMMANDS:
            return None
        found = import_module(f".{name.replace('-', '_')}", __package__).command
        return found if isinstance(found, click.Command) else None

    def format_commands(self, context: click.Context, formatter: click.HelpFormatter) -> None:
        """A line each, from the docstrings as they are written: to import them all would take seconds."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, _summary(name)) for name in COMMANDS])


def _summary(name: str) -> str:
    """The first sentence of a command's docstring."""
    source = Path(__file__).with_name(f"{name.replace('-', '_')}.py").read_text(encoding="utf-8")
    functions = (part for part in ast.parse(source).body if isinstance(part, ast.FunctionDef))
    words = next(ast.get_docstring(function) or "" for function in functions if function.name == "command")
    return words.split(".")[0].replace("\n", " ")


@click.command(cls=Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="nusselt")
def main() -> None:
    """Is a direct-lighting renderer right, and how sure are we?

    Exit status: 0 everything as claimed, 1 something not, 2 bad usage or input, 3 undecided, 4 the reference
    could not run.
    """
