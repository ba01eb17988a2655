"""Independent node of the wire, run by the Python of an environment with pyzeros: what it sees.

    python pyzeros_peer.py ROUTER

It hears `/lariat/text` once, calls `/lariat/start`, publishes on `/lariat/heard`, and prints one
JSON object.
"""

# pyright: reportMissingImports=none

from __future__ import annotations

import asyncio
import json
import sys

import pyzeros
import zenoh
from pyzeros.utils import rmw_zenoh_gid
from ros2_pyterfaces.cydr.all_msgs import String
from ros2_pyterfaces.cydr.all_srvs import Trigger


async def main(router: str) -> None:
    config = zenoh.Config()
    config.insert_json5("mode", '"peer"')
    config.insert_json5("connect/endpoints", json.dumps([router]))
    config.insert_json5("scouting/multicast/enabled", "false")
    session = zenoh.open(config)
    with pyzeros.auto_context(node="peer", zenoh_session=session):
        heard = pyzeros.Sub(String, "/lariat/text")
        text = await asyncio.wait_for(anext(heard.listen_reliable()), 20.0)
        client = pyzeros.Client(Trigger, "/lariat/start")
        await asyncio.wait_for(client.wait_for_service(), 20.0)
        answer = await asyncio.wait_for(client.call_async(Trigger.Request()), 20.0)
        publisher = pyzeros.Pub(String, "/lariat/heard")
        for _ in range(20):
            publisher.publish(String(data=text.data))
            await asyncio.sleep(0.05)
        replies = session.liveliness().get("@ros2_lv/**", timeout=2.0)
        tokens = sorted(str(reply.ok.key_expr) for reply in replies if reply.ok)
        found = {
            "tokens": [t for t in tokens if "/peer/" not in t],
            "gids": {t: rmw_zenoh_gid(t).hex() for t in tokens},
            "text": bytes(text.data).decode(),
            "answer": [bool(answer.success), bytes(answer.message).decode()],
            "publisher": publisher.token_keyexpr,
        }
    print(json.dumps(found), flush=True)
    session.close()


if __name__ == "__main__":
    asyncio.run(main(sys.argv[1]))
