"""`lariat start`: names what it is about to move, and asks before it moves a real arm."""

from __future__ import annotations

import io
import sys
from contextlib import contextmanager

import pytest

from cli import task
from cli.__main__ import main
from shared.messages import RUNNING, ArmState, ArmStates, TaskRequest, TaskState


class Stack:
    """Stack whose arms are of given addresses, and the requests that it got."""

    def __init__(self, **addresses: str) -> None:
        self.requests = []
        arms = [
            ArmState(arm=side, driver="cr5" if address else "ideal", address=address)
            for side, address in addresses.items()
        ]
        self.arms = ArmStates(scenario="three-cylinders", arms=arms)

    def newest_arm_state(self) -> ArmStates:
        return self.arms

    def request_task(self, action: TaskRequest.Action) -> TaskState:
        self.requests.append(action)
        return TaskState(state=RUNNING, reason="started")


@pytest.fixture
def stack(monkeypatch):
    """Puts a stack at the place of the one that a verb connects to."""

    def put(**addresses: str) -> Stack:
        found = Stack(**addresses)

        @contextmanager
        def connect(cell):
            yield found

        monkeypatch.setattr(task, "connect", connect)
        return found

    return put


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_simulated_arms_start_at_once_and_are_named(stack, capsys):
    cell = stack(left="", right="")
    assert main(["start", "--scenario", "three-cylinders"]) == 0
    assert cell.requests == [TaskRequest.START]
    said = capsys.readouterr()
    assert all(w in said.err for w in ("'cell'", "'three-cylinders'", "left ideal (not real)"))
    assert said.out == "running: started\n"


def test_another_scenario_than_the_wanted_one_is_not_started(stack, capsys):
    cell = stack(left="", right="")
    assert main(["start", "--scenario", "cable"]) == 1
    assert cell.requests == []
    assert "'three-cylinders', not 'cable'" in capsys.readouterr().err


@pytest.mark.parametrize(("answer", "started"), [("y\n", True), ("\n", False), ("no\n", False)])
def test_a_real_arm_moves_after_a_yes_only(stack, monkeypatch, capsys, answer, started):
    cell = stack(left="", right="192.168.5.1")
    monkeypatch.setattr(sys, "stdin", Terminal(answer))
    assert main(["start"]) == (0 if started else 1)
    assert cell.requests == ([TaskRequest.START] if started else [])
    said = capsys.readouterr().err
    assert "right cr5 at 192.168.5.1" in said
    assert "real right arm" in said


def test_without_a_terminal_a_real_arm_needs_the_yes_on_the_command_line(
    stack, monkeypatch, capsys
):
    cell = stack(left="192.168.5.2", right="192.168.5.1")
    monkeypatch.setattr(sys, "stdin", io.StringIO("y\n"))
    assert main(["start"]) == 1
    assert cell.requests == []
    assert "add --yes" in capsys.readouterr().err
    assert main(["start", "--yes"]) == 0
    assert cell.requests == [TaskRequest.START]
