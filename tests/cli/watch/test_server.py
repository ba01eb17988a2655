"""Live viewing: what a viewer receives, who is admitted, and that nothing is taken from viewers."""

from __future__ import annotations

import asyncio
import base64
import json
import struct
from urllib.parse import urlsplit

import pytest
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from websockets.asyncio.client import connect
from websockets.exceptions import InvalidStatus
from websockets.typing import Subprotocol

from cli.watch.server import MAX_QUEUE, LiveServer
from dashboard.web import connections
from shared.bus.message_check import RawMessage
from shared.messages import NodeChain

TOKEN = "a token of this test"
FOXGLOVE = [Subprotocol("foxglove.sdk.v1")]
NOW = 1_800_000_000_000_000_000


def message(value: float, key: str = "rope/nodes") -> RawMessage:
    payload = NodeChain(positions=[value, 0.0, 0.0]).SerializeToString()
    return RawMessage(key, "lariat.NodeChain", payload, "p", 0, NOW)


def serve(scene) -> None:
    """Run a scene with a server that listens, and its address."""

    async def run() -> None:
        server = LiveServer("cell2", TOKEN)
        async with server.listening(0) as address:
            await asyncio.wait_for(
                scene(server, address.replace(TOKEN, TOKEN.replace(" ", "%20"))), 20
            )

    asyncio.run(run())


async def heard(viewer):
    return json.loads(await viewer.recv())


def test_a_viewer_receives_what_it_subscribes_to():
    async def scene(server, address):
        server.publish(message(1.0))
        async with connect(address, subprotocols=FOXGLOVE) as viewer:
            info, first = await heard(viewer), await heard(viewer)
            assert (info["name"], info["capabilities"]) == ("lariat cell2", [])
            (rope,) = first["channels"]
            assert (rope["topic"], rope["encoding"]) == ("rope/nodes", "protobuf")
            files = FileDescriptorSet.FromString(base64.b64decode(rope["schema"])).file
            assert rope["schemaName"] in {
                f"{f.package}.{m.name}" for f in files for m in f.message_type
            }
            # A topic that appears later is announced.
            server.publish(message(1.0, "rope/truth"))
            (truth,) = (await heard(viewer))["channels"]
            assert truth["topic"] == "rope/truth"
            wanted = {"op": "subscribe", "subscriptions": [{"id": 7, "channelId": rope["id"]}]}
            await viewer.send(json.dumps(wanted))
            await viewer.send(json.dumps({"op": "advertise", "channels": []}))
            assert "read-only" in (await heard(viewer))["message"]
            server.publish(message(2.0, "rope/truth"))
            server.publish(message(3.0))
            frame = await viewer.recv()
            assert struct.unpack_from("<BIQ", frame) == (1, 7, NOW)
            assert NodeChain.FromString(frame[13:]).positions[0] == 3.0
            await viewer.send(json.dumps({"op": "unsubscribe", "subscriptionIds": [7]}))
            await viewer.send("no JSON")
            assert "protocol" in (await heard(viewer))["message"]
            await viewer.send('{"op": "unsubscribe", "subscriptionIds": [1e400]}')
            assert "protocol" in (await heard(viewer))["message"]
            server.publish(message(4.0))
            server.publish(message(5.0, "scene/state"))
            assert "channels" in await heard(viewer)

    serve(scene)


@pytest.mark.parametrize(
    ("query", "host", "status"),
    [("", "", 401), ("?token=wrong", "", 401), (None, "evil.example:8765", 403)],
)
def test_only_who_knows_the_token_and_names_this_machine_is_admitted(query, host, status):
    async def scene(server, address):
        wanted = address if query is None else address.partition("?")[0] + query
        where = urlsplit(address)
        named = wanted.replace(where.netloc, host or where.netloc)
        with pytest.raises(InvalidStatus) as refused:
            async with connect(named, subprotocols=FOXGLOVE, host=where.hostname, port=where.port):
                pass
        assert refused.value.response.status_code == status

    serve(scene)


def test_a_viewer_that_does_not_read_loses_the_oldest_messages():
    async def scene(server, address):
        server.publish(message(0.0))
        async with connect(address, subprotocols=FOXGLOVE) as viewer:
            await heard(viewer)
            await heard(viewer)
            wanted = {"op": "subscribe", "subscriptions": [{"id": 1, "channelId": 1}]}
            await viewer.send(json.dumps(wanted))
            await viewer.send("answered when the subscription is known")
            await heard(viewer)
            # Without a turn for the sender between them.
            for k in range(2 * MAX_QUEUE):
                server.publish(message(float(k)))
            first = NodeChain.FromString((await viewer.recv())[13:]).positions[0]
            assert first == MAX_QUEUE

    serve(scene)


def test_half_open_connections_are_bounded_and_leave_an_admitted_viewer(
    monkeypatch: pytest.MonkeyPatch,
):
    monkeypatch.setattr(connections, "STRANGER_TIME", 1.0)

    async def scene(server, address):
        port = urlsplit(address).port
        async with connect(address, subprotocols=FOXGLOVE) as viewer:
            crowd = [
                await asyncio.open_connection("127.0.0.1", port)
                for _ in range(connections.MAX_STRANGERS + 2)
            ]
            # The oldest go first, and all at last.
            assert await ended(crowd[0])
            assert await ended(crowd[-1])
            assert (await heard(viewer))["op"] == "serverInfo"
            await viewer.send('{"op": "other"}')
            while (await heard(viewer))["op"] != "status":
                pass
            for _, writer in crowd:
                writer.close()

    async def ended(stream) -> bool:
        try:
            return not await asyncio.wait_for(stream[0].read(1), 5.0)
        except ConnectionResetError:
            return True

    serve(scene)
