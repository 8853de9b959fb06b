"""A running `upt view`, and what its messages hold (crates/cli/src/view/protocol.rs)."""

from __future__ import annotations

import json
import os
import struct
import subprocess
import time
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from client import RawClient, Refused

ROOT = Path(__file__).resolve().parents[2]
COMMAND = os.environ.get("UPT_COMMAND", str(ROOT / "target/release/upt"))
TOOL = {"position": [0, 0, 0], "rotation": [0, 0, 0, 1], "radius": 5, "half_length": 20, "friction": 0.3}
HEADER = 36  # numbers before the displacements


@contextmanager
def server(bundle: Path, *more: str):
    """Port and token of a running `upt view`."""
    command = [COMMAND, "view", str(bundle), *more]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        address = process.stdout.readline().strip()
        rest, token = address.split("/?token=")
        yield int(rest.rsplit(":", 1)[1]), token
        assert process.poll() is None, "the server has ended"
    finally:
        process.kill()
        process.wait()


class Frame(NamedTuple):
    """What the tests read of a frame; see protocol.rs."""

    sequence: int
    steps: int
    largest: float
    force: tuple[float, float, float]
    area: float
    removed: float
    copies: int
    undos: int
    height: float
    torn: int
    places: int


def take(client: RawClient) -> Frame:
    opcode, data = client.read()
    while opcode == 1:  # of a surface that has changed: its numbers follow
        client.told.append((json.loads(data), client.read()[1]))
        opcode, data = client.read()
    assert opcode == 2, (opcode, data[:200])
    head = data[: 4 * HEADER]
    words, numbers = struct.unpack(f"<{HEADER}I", head), struct.unpack(f"<{HEADER}f", head)
    places = (len(data) - len(head)) // 12
    return Frame(
        words[0],
        words[11],
        numbers[9],
        numbers[6:9],
        numbers[25],
        numbers[26],
        words[27],
        words[28],
        numbers[30],
        words[35],
        places,
    )


def frame(client: RawClient, tool: dict | None, sequence: int) -> Frame:
    """Asks for a frame with the tool there, and reads it."""
    client.send(json.dumps({"tool": tool, "sequence": sequence}).encode())
    return take(client)


def tip_of_the_phantom(client: RawClient) -> list[float]:
    """The node in the middle of the upper side, from the first two messages."""
    hello = json.loads(client.read()[1])
    geometry = client.read()[1]
    n = hello["surface_node_count"]
    rest = struct.unpack(f"<{3 * n}f", geometry[: 12 * n])
    nodes = [rest[3 * i : 3 * i + 3] for i in range(n)]
    top = max(node[2] for node in nodes)
    upper = [node for node in nodes if node[2] == top]
    x, y, _ = min(upper, key=lambda node: abs(node[0] - 30) + abs(node[1] - 30))
    return [x, y, top]


def pressing(top: list[float], depth: float) -> dict:
    """The tool, standing on its axis, its tip so deep below a place of the upper side."""
    x, y, z = top
    return TOOL | {"position": [x, y, z + 25.0 - depth], "rotation": [0.70710678, 0, 0, 0.70710678]}


def connect_when_free(port: int, token: str) -> RawClient:
    """The place of a client that has just gone is free a moment later."""
    for _ in range(500):
        try:
            return RawClient(port, f"/socket?token={token}")
        except Refused:
            time.sleep(0.02)
    raise AssertionError("the place never became free")
