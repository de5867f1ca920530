"""What a running tev is sent, and what happens where there is none, or no longer one."""

from __future__ import annotations

import socket

import numpy as np
import pytest
from click.testing import CliRunner
from tev_listener import listening

from nusselt.experiments.cli.main import main
from nusselt.experiments.terminal.tev import Tev


def test_an_image_is_created_once_and_each_channel_updated():
    image = np.arange(2 * 3 * 4, dtype=float).reshape(2, 3, 4)[[0, 1, 1]]
    with listening() as (address, told):
        tev = Tev(address)
        tev.show("quad", {"ours": image, "z": image[:1] - 7})
        tev.show("quad", {"ours": image + 1})
        tev.close()
    assert [one[:2] for one in told].count(("create", "quad: ours")) == 1
    assert ("create", "quad: z", (4, 3), ("Z",)) in told
    assert [one[2] for one in told if one[:2] == ("update", "quad: ours")] == ["R", "G", "B"] * 2
    last = told[-1]
    assert last[3] == (0, 0, 4, 3)
    np.testing.assert_array_equal(np.reshape(last[4], (3, 4)), image[2] + 1)


def test_a_tev_that_goes_away_ends_nothing_and_is_said_once(capsys):
    server = socket.create_server(("127.0.0.1", 0))
    tev = Tev(f"127.0.0.1:{server.getsockname()[1]}")
    server.accept()[0].close()
    server.close()
    for _ in range(8):  # the first may still fall into the system's buffers
        tev.show("quad", {"ours": np.zeros((3, 64, 64))})
    assert capsys.readouterr().err.count("tev is gone") == 1


@pytest.mark.parametrize("address", ["127.0.0.1:1", "nowhere", "127.0.0.1:x", "127.0.0.1:70000"])
def test_a_tev_that_is_not_there_is_one_line_before_any_work(address, tmp_path):
    done = CliRunner().invoke(main, ["check", "quad", "--until-decided", "--out", str(tmp_path), "--tev", address])
    assert done.exit_code == 2
    assert done.output.count("\n") == 1
    assert "tev" in done.output
    assert not list(tmp_path.iterdir())
