"""Drivers of a scenario's ends."""

from __future__ import annotations

from dataclasses import replace

import pytest

from lariat.configuration import ConfigurationError
from lariat.scenario import Scenario, load
from services.robot_gateway.drivers.cr5.tcp_link import TcpLink
from services.robot_gateway.drivers.factory import drivers_of
from stack.simulation.emulated_arms import emulated_links

FIRST_STEP = 1_000_000_000


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    return load("fixed-end")


def test_arm_without_address_needs_an_emulator(scenario: Scenario) -> None:
    with pytest.raises(ConfigurationError, match="--right-emulator"):
        drivers_of(scenario, scenario.grips(scenario.start), {}, {})


def test_arm_on_an_emulators_host_is_live_and_can_be_placed(scenario: Scenario) -> None:
    starts = scenario.grips(scenario.start)
    left, right = drivers_of(scenario, starts, {"right": "127.0.0.1"}, {})
    assert not left.moves
    assert right.live
    assert right.place(starts[1])


def test_link_of_the_caller_takes_the_place_of_an_address(
    scenario: Scenario, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise AssertionError("a real arm must not be connected to")

    monkeypatch.setattr(TcpLink, "__init__", refuse)
    end = replace(scenario.ends.right, address="127.0.0.1")
    addressed = replace(scenario, ends=replace(scenario.ends, right=end))
    starts = addressed.grips(addressed.start)
    _, right = drivers_of(addressed, starts, {}, emulated_links(addressed, FIRST_STEP))
    assert not right.live
    assert not right.place(starts[1]), "only an emulator can be placed"
