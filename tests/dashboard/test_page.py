from __future__ import annotations

import pytest

from dashboard.outbox import Outbox
from dashboard.page import Page
from dashboard.scene.scene_view import SceneView
from dashboard.subscriptions import READS
from dashboard.web.private_viser import PrivateViser
from lariat.scenario import load
from lariat.trajectory import SECOND
from shared import topics
from shared.messages import NodeChain
from shared.runtime.service import Mailbox, Received


@pytest.mark.parametrize(("live", "drawn"), [(True, [0, 2, 4, 5]), (False, [0, 1, 2, 3, 4, 5])])
def test_every_second_step_of_a_live_cell_draws_the_newest_rope(
    live: bool, drawn: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    private = PrivateViser("test")
    monkeypatch.setattr(private.server, "get_clients", lambda: {0: None})
    shown: list[int] = []
    monkeypatch.setattr(SceneView, "show_rope", lambda _, message: shown.append(message.stamp))
    page = Page(private.server, load("scenarios/three-cylinders.toml"), Outbox("a"), live)
    try:
        mailbox = Mailbox(READS)
        for step in range(8):
            now = 1_000 * SECOND + step * SECOND // 30
            if step < 6:
                chain = NodeChain(stamp=step)
                received = Received(chain, "perception", step, now)
                mailbox.deliver(topics.ROPE_NODES.key, received)
            page.update(mailbox.take(), now)
        assert shown == drawn
    finally:
        page.close()
        private.close()
