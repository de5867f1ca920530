"""`nusselt peers`: other renderers, and their environments."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from nusselt.experiments.console import console
from nusselt.experiments.external.program import ProgramFailed
from nusselt.experiments.peers.environment import Environments, InstallFailed, default_folder
from nusselt.experiments.peers.renderer import prove
from nusselt.experiments.peers.renderers import PEERS, peer_of
from nusselt.experiments.peers.tables import peers_table
from nusselt.experiments.terminal.group import Group, stop

environments_option = click.option(
    "--environments",
    type=click.Path(path_type=Path),
    help="Folder of the peers' environments, instead of $NUSSELT_PEERS or the user's cache.",
)


def environments_in(folder: Path | None) -> Environments:
    """Those of a folder; None: of the usual one."""
    return Environments(folder or default_folder())


@click.group(cls=Group, invoke_without_command=True)
@environments_option
@click.pass_context
def command(context: click.Context, environments: Path | None) -> None:
    """Other renderers that scenes are compared with: which are there, and how to have them.

    \b
    nusselt peers
    nusselt peers install radiance
    nusselt cross my.test --peers radiance,cycles --out out
    """
    context.obj = environments_in(environments)
    if context.invoked_subcommand is None:
        told = console()
        told.print(peers_table(PEERS, context.obj, told.width))


@command.command()
@click.argument("names", metavar="NAME...", nargs=-1, required=True)
@click.option("--python", default=sys.executable, help="A Python of the version that the peer is made for.")
@click.pass_obj
def install(environments: Environments, names: tuple[str, ...], python: str) -> None:
    """Make the environment of each peer NAME from its pinned packages, outside ours, and try it on a few pixels."""
    peers = [peer_of(name) for name in names]
    for peer in peers:
        click.echo(f"{peer.title}: about {peer.megabytes} MB, {peer.licence}")
        try:
            packages = environments.install(peer, python)
            click.echo(f"{peer.name}: {' '.join(packages)} in {environments.folder / peer.name}")
            version = prove(peer, environments.launch(peer) or [])
        except (InstallFailed, ProgramFailed) as problem:
            stop(f"{peer.name}: {problem}", 1)
        click.echo(f"{peer.name}: {version} renders; now: nusselt cross SCENE --peers {peer.name}")
