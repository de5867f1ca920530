"""Images to a running tev, as they become known: its IPC over TCP.

A packet is its length (uint32, itself included), its kind (uint8), a byte that asks for focus, and the image's name up
to a zero byte; numbers are little-endian. CreateImage (4) goes on with int32 width, height and number of channels, and
their names. UpdateImage (3, as pbrt-v4 sends it) goes on with one channel's name, int32 x, y, width, height, and its
float32 values row by row.
"""

from __future__ import annotations

import socket
import struct
from collections.abc import Mapping
from typing import Any

import click
import numpy as np

from nusselt.renderer.errors import InputError

from .progress import ERRORS

CREATE, UPDATE = 4, 3
PATIENCE = 5.0
"""Seconds within which tev must take what it is sent: it never holds up the work for longer."""
CHANNELS = {3: ("R", "G", "B"), 1: ("Z",)}


class Tev:
    """A connection to tev; once it is lost, nothing is sent, and the work goes on.

    Parameters
    ----------
    address : str
        HOST:PORT; tev's own port is 14158.

    Raises
    ------
    InputError
        If nothing listens there.
    """

    def __init__(self, address: str) -> None:
        self._address = address
        host, _, port = address.rpartition(":")
        if not host or not port.isdecimal() or not 0 < int(port) < 1 << 16:
            raise InputError("tev", address, "HOST:PORT, for example 127.0.0.1:14158")
        try:
            self._socket: socket.socket | None = socket.create_connection((host.strip("[]"), int(port)), PATIENCE)
        except OSError as error:
            raise InputError("tev", address, f"a tev that listens there ({error.strerror or error})") from error
        self._created: set[str] = set()

    def __repr__(self) -> str:
        return self._address

    def show(self, title: str, images: Mapping[str, np.ndarray[Any, Any]]) -> None:
        """Show images (3, h, w), or (1, h, w) of plain numbers, by name; what was shown of that name is replaced."""
        for name, image in images.items():
            self._send(*packets(f"{title}: {name}", image, self._created))

    def _send(self, *given: bytes) -> None:
        if self._socket is None:
            return
        try:
            for packet in given:
                self._socket.sendall(packet)
        except OSError as error:
            ERRORS.print(f"nusselt: tev is gone ({error.strerror or error}): the work goes on", markup=False)
            self.close()

    def close(self) -> None:
        """End the connection; what is shown stays."""
        if self._socket is not None:
            self._socket.close()
        self._socket = None


def packets(name: str, image: np.ndarray[Any, Any], created: set[str]) -> list[bytes]:
    """What shows an image; it is created where its name is not in ``created`` yet, and is put there."""
    channels, (height, width) = CHANNELS[len(image)], image.shape[1:]
    found = []
    if name not in created:
        created.add(name)
        words = b"".join(map(_text, channels))
        found.append(_packet(CREATE, name, struct.pack("<3i", width, height, len(channels)) + words))
    for channel, plane in zip(channels, image, strict=True):
        place = _text(channel) + struct.pack("<4i", 0, 0, width, height)
        found.append(_packet(UPDATE, name, place + np.ascontiguousarray(plane, dtype="<f4").tobytes()))
    return found


def _packet(kind: int, name: str, rest: bytes) -> bytes:
    body = struct.pack("<BB", kind, 0) + _text(name) + rest
    return struct.pack("<I", 4 + len(body)) + body


def _text(words: str) -> bytes:
    return words.replace("\0", " ").encode() + b"\0"


class TevAddress(click.ParamType):  # type: ignore[type-arg]  # older versions have no parameter
    """HOST:PORT of a tev that is connected to before any work."""

    name = "HOST:PORT"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Tev:
        """The connection."""
        return value if isinstance(value, Tev) else Tev(str(value))
