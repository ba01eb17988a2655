"""Live viewing with Foxglove's own client."""

from __future__ import annotations

import asyncio

from cli.watch.server import LiveServer
from shared.bus.message_check import RawMessage
from shared.messages import NodeChain
from tests.javascript import needs_libraries, run

pytestmark = needs_libraries
NOW = 1_800_000_000_000_000_000
TOKEN = "token-of-this-test"


def said_by_the_client(address_of: str = "{}") -> list[dict]:
    """Lines of the client while ropes are published, at an address made from the printed one."""

    async def scene() -> list[dict]:
        server = LiveServer("cell2", TOKEN)
        async with server.listening(0) as address:
            words = address_of.format(address), "rope/nodes", "3"
            client = asyncio.create_task(asyncio.to_thread(run, "watch.mjs", *words))
            number = 0
            while not client.done():
                rope = NodeChain(stamp=number, positions=[0.5, 0.25, number])
                payload = rope.SerializeToString()
                server.publish(
                    RawMessage("rope/nodes", "lariat.NodeChain", payload, "p", 0, NOW + number)
                )
                number += 1
                await asyncio.sleep(0.01)
            return client.result()

    return asyncio.run(scene())


def test_foxgloves_client_reads_the_rope_and_can_publish_nothing():
    info, *ropes, answer = said_by_the_client()
    assert info == {"server": "lariat cell2", "capabilities": []}
    assert len(ropes) == 3
    first = int(ropes[0]["message"].get("stamp", 0))
    for k, rope in enumerate(ropes):
        assert rope["message"]["positions"] == [0.5, 0.25, first + k]
        assert int(rope["time"]) == NOW + first + k
    assert "read-only" in answer["status"]


def test_foxgloves_client_is_refused_without_the_token():
    (line, *_) = said_by_the_client("{}0")
    assert "401" in line["error"]
