"""The verbs of the arms against a gateway that runs."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from cli import __main__ as lariat
from shared import topics
from tests.shared.cell import Cell, until

pytestmark = pytest.mark.live

SCENARIO = Path(__file__).parents[2] / "scenarios" / "three-cylinders.toml"


@pytest.fixture
def cell() -> Iterator[Cell]:
    with ExitStack() as stack:
        cell = Cell(stack)
        command = [sys.executable, "-m", "services.robot_gateway", "--scenario", str(SCENARIO)]
        gateway = subprocess.Popen([*command, *cell.arguments])
        try:
            states = cell("ear").subscribe(topics.ARM_STATE)
            until(states.take, 30.0)
            yield cell
        finally:
            gateway.kill()
            gateway.wait()


def said(cell: Cell, capfd: pytest.CaptureFixture[str], *words: str) -> dict:
    assert lariat.main([*words, "--json", *cell.arguments]) == 0
    return json.loads(capfd.readouterr().out)


def test_each_gripper_opens_and_closes_and_arms_say_how_they_are(
    cell: Cell, capfd: pytest.CaptureFixture[str]
) -> None:
    arms = said(cell, capfd, "grip", "open", "--side", "left")["arms"]
    assert [arms[side]["gripper_closed"] for side in ("left", "right")] == [False, True]
    arms = said(cell, capfd, "grip", "close", "--side", "left")["arms"]
    assert arms["left"]["gripper_closed"]
    state = said(cell, capfd, "disarm")
    assert (state["mode"], state["cause"]) == ("disarmed", "disarm")
    assert said(cell, capfd, "arm")["cause"] == ""
    assert lariat.main(["ack", *cell.arguments]) == 1
    assert "while armed" in capfd.readouterr().err
