"""A tev that listens and keeps what it is told, packet by packet, as its own reader takes them apart."""

from __future__ import annotations

import socket
import struct
import threading
from collections.abc import Iterator
from contextlib import contextmanager


def taken_apart(packet: bytes) -> tuple:
    """(kind, name, ...) of a packet without its length: channels and size of a new image, or a channel's values."""
    kind, (name, rest) = packet[0], packet[2:].split(b"\0", 1)
    if kind == 4:
        width, height, count = struct.unpack_from("<3i", rest)
        return "create", name.decode(), (width, height), tuple(rest[12:].decode().split("\0")[:count])
    channel, rest = rest.split(b"\0", 1)
    x, y, width, height = struct.unpack_from("<4i", rest)
    values = struct.unpack(f"<{width * height}f", rest[16:])
    return "update", name.decode(), channel.decode(), (x, y, width, height), values


@contextmanager
def listening() -> Iterator[tuple[str, list[tuple]]]:
    """Its address, and what it has been told so far: whole when the block has ended."""
    told: list[tuple] = []
    server = socket.create_server(("127.0.0.1", 0))

    def serve() -> None:
        connection, _ = server.accept()
        with connection, connection.makefile("rb") as stream:
            while head := stream.read(4):
                told.append(taken_apart(stream.read(struct.unpack("<I", head)[0] - 4)))

    thread = threading.Thread(target=serve, daemon=True)
    thread.start()
    try:
        yield f"127.0.0.1:{server.getsockname()[1]}", told
        thread.join(10)
    finally:
        server.close()
