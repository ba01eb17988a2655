"""HOLD on the page of a live stack while others attack the page."""

from __future__ import annotations

import json

import pytest

from benchmarks.faults import holds
from benchmarks.tables import PrintOptions

pytestmark = pytest.mark.live


def test_every_hold_is_confirmed_while_each_attack_arrives(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    # A tenth of what arrives in the bench: each attack has begun, and goes on until it is ended.
    fewer = {name: (attack, -(-count // 10)) for name, (attack, count) in holds.CASES.items()}
    monkeypatch.setattr(holds, "CASES", fewer)
    holds.run(seconds=2.0, options=PrintOptions(json=True))
    rows = json.loads(capsys.readouterr().out)["holds"]
    assert [row["case"] for row in rows] == list(holds.CASES)
    for row in rows:
        assert row["attacks"] > 0
        assert row["holds"] > 0
        assert row["unconfirmed"] == 0
