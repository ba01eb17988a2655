"""Emulated arms in memory."""

from __future__ import annotations

from lariat.scenario import load
from lariat.trajectory import SECOND
from stack.simulation.emulated_arms import MemoryLink, emulated_links


def test_every_cr5_of_a_scenario_has_a_link() -> None:
    assert list(emulated_links(load("two-arms"), SECOND)) == ["left", "right"]
    assert list(emulated_links(load("fixed-end"), SECOND)) == ["right"]


def test_emulator_starts_shortly_before_the_first_step_at_any_time() -> None:
    first_step = 1_800_000_000 * SECOND
    link = emulated_links(load("fixed-end"), first_step)["right"]
    steps = 0

    def count(now: float, controller: object) -> None:
        nonlocal steps
        steps += 1

    link.emulator._watch = count
    link.advance(first_step)
    assert steps == 125, "one second"


def test_bytes_reach_the_emulator_and_replies_come_back() -> None:
    link: MemoryLink = emulated_links(load("fixed-end"), SECOND)["right"]
    stream = link.open(29999)
    assert stream.state == "open"
    stream.send(b"RobotMode()")
    link.advance(SECOND)
    assert stream.receive() == b"0,{4},RobotMode();"
    stream.close()
    assert stream.state == "closed"
    refused = link.open(1)
    assert refused.state == "closed"
    assert "refused" in refused.reason
