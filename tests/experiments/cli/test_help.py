"""What `nusselt` says of itself waits for no library, and says what each command does."""

from __future__ import annotations

import subprocess
import sys

import click
import pytest

from nusselt.experiments.cli.main import COMMANDS, main

HEAVY = ("numpy", "scipy", "matplotlib", "rich", "mitsuba")
ASK = """
import sys
from nusselt.experiments.cli.main import main
try:
    main([{word!r}])
except SystemExit:
    pass
print("loaded", *sorted(set({heavy!r}) & set(sys.modules)))
"""


@pytest.mark.parametrize("word", ["--help", "--version"])
def test_help_waits_for_no_library(word):
    done = subprocess.run(
        [sys.executable, "-c", ASK.format(word=word, heavy=HEAVY)], capture_output=True, text=True, check=True
    )
    assert done.stdout.splitlines()[-1] == "loaded"


@pytest.mark.parametrize("command", ["render", "check", "compare", "metamorphic"])
def test_no_command_waits_for_the_laws_that_only_a_verdict_needs(command):
    asked = f"import sys, nusselt.experiments.cli.{command}\nprint('scipy.stats' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", asked], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


def test_every_command_is_told_by_its_own_first_sentence():
    context = click.Context(main)
    told = " ".join(main.get_help(context).split())
    for name in COMMANDS:
        command = main.get_command(context, name)
        first = (command.help or "").split(".")[0]
        assert " ".join(f"{name} {first}".split()) in told
