"""Switch to another cell: when it is refused, confirmed, undone."""

from __future__ import annotations

import re
import sys
import time
from pathlib import Path

import pytest

from lariat.scenario import Scenario, find, load
from shared.messages import (
    PAUSED,
    RUNNING,
    ArmStates,
    StackRequest,
    StackState,
    TaskState,
    validation,
)
from shared.topics import STACK_STATE
from stack.launcher.process import Program
from stack.scenario_manager.campaign.campaigns import Campaigns
from stack.scenario_manager.library import ScenarioLibrary
from stack.scenario_manager.scenario_manager import CellCondition, ScenarioManager

READY = CellCondition(TaskState(), ArmStates(mode=ArmStates.ARMED))


class Switch(ScenarioManager):
    """A switch whose check takes any scenario, or none."""

    def __init__(
        self,
        folder: Path,
        first: Path | None = None,
        check: str = "",
        name: str = "three-cylinders",
    ) -> None:
        first = first or find(name)
        library = ScenarioLibrary(folder / "saved", first)
        command = [sys.executable, "-S", "-c", check]
        trial = ["-S", "-c", "import time; time.sleep(60)"]
        campaigns = Campaigns(folder / "tables", folder / "trials", lambda *_: trial)
        staged = folder / "staged"
        super().__init__(library, first, staged, lambda _: command, campaigns, self._programs_of)

    def _programs_of(self, path: Path, scenario: Scenario) -> list[Program]:
        return [Program(scenario.name, str(path))]

    def state(self) -> StackState:
        state = StackState()
        self.fill(state)
        return state

    def ask(self, condition: CellCondition = READY, **fields: object) -> str:
        """The refusal of a request."""
        self.handle(StackRequest(id="a", **fields), condition)
        assert self.state().last_request == "a"
        return self.state().refusal

    def wait(self, condition: CellCondition = READY) -> Path | None:
        """The scenario to start after the check."""
        deadline = time.monotonic() + 10.0
        while self.state().activity.startswith("checking") and time.monotonic() < deadline:
            if self.poll(lambda: condition):
                return Path(self.programs[0].module)
            time.sleep(0.01)
        return None


def real_cell(folder: Path) -> Path:
    text = load("fixed-end").text.replace('driver = "cr5"', 'driver = "cr5"\naddress = "10.0.0.6"')
    path = folder / "saved" / "real" / "real.toml"
    path.parent.mkdir(parents=True)
    path.write_text(text)
    assert load(path).ends.right.address
    return path


def test_chosen_scenario_starts_after_its_check(tmp_path: Path) -> None:
    switch = Switch(tmp_path)
    assert switch.state().scenario == "three-cylinders"
    assert not switch.ask(action=StackRequest.START, scenario="rope")
    assert switch.state().activity == "checking rope"
    assert switch.wait() == find("rope")
    assert switch.state().scenario == "rope"
    assert switch.state().activity == "starting rope"
    switch.confirm_ready()
    assert not switch.state().activity
    assert not switch.take_failure("dies later")


def test_settings_start_the_running_scenario_with_changes(tmp_path: Path) -> None:
    switch = Switch(tmp_path)
    settings = ["control.clearance=0.02", "run.tolerance=1e-3"]
    assert not switch.ask(action=StackRequest.START, settings=settings)
    path = switch.wait()
    assert path is not None
    scenario = load(path)
    assert (scenario.control.clearance, scenario.run.tolerance) == (0.02, 1e-3)
    assert switch.state().scenario == "three-cylinders, changed"
    switch.confirm_ready()
    # What follows builds on it.
    assert not switch.ask(action=StackRequest.SAVE, settings=["seed=3"], name="mine")
    assert "mine" in [entry.name for entry in switch.state().scenarios]
    assert not switch.ask(action=StackRequest.START, scenario="mine")
    path = switch.wait()
    assert path is not None
    assert (load(path).control.clearance, load(path).seed) == (0.02, 3)


def test_uploaded_file_starts_under_its_name(tmp_path: Path) -> None:
    content = load("rope").text.replace('name = "rope"', 'name = "../../evil"').encode()
    switch = Switch(tmp_path, name="rope")
    assert not switch.ask(action=StackRequest.START, content=content)
    path = switch.wait()
    assert path is not None
    assert path.is_relative_to(tmp_path / "staged")
    assert load(path).name == "../../evil"


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"settings": ["control.clearance=5"]}, "out of bounds"),
        ({"settings": ["control.method=os:system"]}, "names a class"),
        ({"settings": ["ends.right.driver=ur", "ends.right.urdf=/etc/passwd"]}, "urdf"),
        ({"content": b"\xff"}, "no text"),
        ({"content": b"[rope"}, "not valid TOML"),
        ({"scenario": "../x"}, "no scenario"),
    ],
)
def test_bad_scenario_is_refused_at_once(tmp_path: Path, fields: dict, words: str) -> None:
    switch = Switch(tmp_path)
    assert words in switch.ask(action=StackRequest.START, **fields)
    assert not switch.state().activity


def test_scenario_whose_check_fails_does_not_start(tmp_path: Path) -> None:
    switch = Switch(tmp_path, check="import sys; sys.exit('lariat: goal: inside an obstacle')")
    switch.ask(action=StackRequest.START, scenario="rope")
    assert switch.wait() is None
    assert "inside an obstacle" in switch.state().refusal
    assert switch.state().scenario == "three-cylinders"


@pytest.mark.parametrize("state", [RUNNING, PAUSED])
def test_run_that_goes_on_is_not_ended(tmp_path: Path, state: int) -> None:
    running = CellCondition(TaskState(state=state), READY.arms)
    switch = Switch(tmp_path)
    refusal = switch.ask(running, action=StackRequest.START, scenario="rope")
    assert "stop it first" in refusal
    # Nor one that has begun during the check.
    switch.ask(action=StackRequest.START, scenario="rope")
    assert switch.wait(running) is None
    assert "stop it first" in switch.state().refusal


def test_real_arms_must_be_confirmed_by_their_addresses(tmp_path: Path) -> None:
    real_cell(tmp_path)
    switch = Switch(tmp_path)
    request = {"action": StackRequest.START, "scenario": "real"}
    assert "10.0.0.6: a person must confirm" in switch.ask(**request)
    assert "a person must confirm" in switch.ask(**request, confirmed=["10.0.0.7"])
    assert not switch.ask(**request, confirmed=["10.0.0.6"])


@pytest.mark.parametrize("setting", ["limits.speed=2.0", "ends.right.load=1.0", "obstacles=[]"])
def test_safety_of_a_real_cell_is_not_changed_from_the_page(tmp_path: Path, setting: str) -> None:
    path = real_cell(tmp_path)
    switch = Switch(tmp_path)
    fields = {"scenario": "real", "settings": [setting]}
    words = "of a cell with real arms cannot be changed"
    assert words in switch.ask(action=StackRequest.START, confirmed=["10.0.0.6"], **fields)
    assert words in switch.ask(action=StackRequest.SAVE, name="other", **fields)
    # Nor by a file, nor by an address in a simulated cell.
    content = path.read_bytes()
    assert words in switch.ask(action=StackRequest.START, content=content, confirmed=["10.0.0.6"])
    address = ["ends.right.driver=cr5", "ends.right.address=10.0.0.6"]
    assert words in switch.ask(action=StackRequest.START, settings=address, confirmed=["10.0.0.6"])
    assert not switch.ask(action=StackRequest.SAVE, scenario="real", name="o", settings=["seed=4"])


@pytest.mark.parametrize(
    ("arms", "refused"),
    [
        (None, True),
        (ArmStates(mode=ArmStates.HOLDING), True),
        (ArmStates(mode=ArmStates.ARMED), True),
        (ArmStates(mode=ArmStates.DISARMED), False),
    ],
)
def test_cell_with_real_arms_ends_only_disarmed(
    tmp_path: Path, arms: ArmStates | None, refused: bool
) -> None:
    switch = Switch(tmp_path, real_cell(tmp_path))
    condition = CellCondition(TaskState(), arms)
    assert bool(switch.ask(condition, action=StackRequest.START, scenario="rope")) == refused


def test_cell_is_what_was_confirmed_whatever_becomes_of_its_file(tmp_path: Path) -> None:
    switch = Switch(tmp_path)
    assert not switch.ask(action=StackRequest.SAVE, scenario="rope", name="mine")
    path = tmp_path / "saved" / "mine" / "mine.toml"
    real = load(real_cell(tmp_path)).text
    for text in ("", real, "a." * 30_000 + "a = 1"):
        assert not switch.ask(action=StackRequest.START, scenario="mine")
        kept = path.read_text()
        # While the check goes on.
        path.write_text(text)
        assert switch.wait() == path
        assert [program.name for program in switch.programs] == ["mine"]
        assert switch.take_failure("sim: no such plant")
        path.write_text(kept)
    assert not switch.ask(action=StackRequest.START, scenario="mine")
    assert switch.wait() == path
    switch.confirm_ready()
    path.write_text(real)
    # Simulated arms need not be disarmed.
    assert not switch.ask(action=StackRequest.START, scenario="rope")


def test_real_arms_stay_real_when_their_file_is_gone(tmp_path: Path) -> None:
    path = real_cell(tmp_path)
    switch = Switch(tmp_path, path)
    path.write_text(load("rope").text)
    refusal = switch.ask(action=StackRequest.START, scenario="rope")
    assert "disarm" in refusal


def test_former_cell_returns_where_the_new_one_does_not_come_up(tmp_path: Path) -> None:
    switch = Switch(tmp_path)
    switch.ask(action=StackRequest.START, scenario="rope")
    assert switch.wait() == find("rope")
    assert switch.take_failure("sim: no such plant")
    assert switch.programs == [Program("three-cylinders", str(find("three-cylinders")))]
    state = switch.state()
    assert (state.scenario, state.activity) == ("three-cylinders", "")
    assert re.search(r"rope.*sim: no such plant.*three-cylinders", state.refusal)


def test_second_request_waits_for_the_first(tmp_path: Path) -> None:
    switch = Switch(tmp_path, check="import time; time.sleep(60)")
    switch.ask(action=StackRequest.START, scenario="rope")
    assert "checking rope; wait" in switch.ask(action=StackRequest.START, scenario="cable")
    switch.close()


def test_running_scenario_is_not_deleted(tmp_path: Path) -> None:
    switch = Switch(tmp_path)
    switch.ask(action=StackRequest.SAVE, name="mine")
    switch.ask(action=StackRequest.START, scenario="mine")
    switch.wait()
    switch.confirm_ready()
    assert "mine runs" in switch.ask(action=StackRequest.DELETE, name="mine")


HOSTILE_SETTINGS = [
    "a=" + "[" * 4000,
    "=",
    "rope",
    "rope=1",
    "rope.length.x=1",
    "obstacles.99.position=[0, 0, 0]",
    "obstacles.0.position.0=x",
    "seed=2020-01-01",
    "seed=" + "9" * 4000,
    "a b.c=1",
    "goal={nodes='../../../etc/passwd'}",
    "goal={nodes='/dev/zero'}",
    "start.line=[[nan, 0, 0], [inf, 0, 0]]",
    "cameras.x.y=1",
    "events=[1, 2]",
    "version=99",
    "\ud7ff.\u2028=1",
]


@pytest.mark.parametrize("setting", HOSTILE_SETTINGS)
@pytest.mark.parametrize("action", [StackRequest.START, StackRequest.SAVE])
def test_hostile_setting_is_refused_and_ends_nothing(
    tmp_path: Path, setting: str, action: int
) -> None:
    switch = Switch(tmp_path)
    assert switch.ask(action=action, settings=[setting], name="mine")
    assert not switch.state().activity
    assert not (tmp_path / "saved" / "mine").exists()


@pytest.mark.parametrize("content", [b"a=" + b"[" * 200_000, b"\x00" * 1000, b"[" * 1000, b"x = 1"])
def test_hostile_file_is_refused_and_ends_nothing(tmp_path: Path, content: bytes) -> None:
    switch = Switch(tmp_path)
    assert switch.ask(action=StackRequest.START, content=content)
    assert not switch.state().activity


def test_campaign_is_refused_beside_real_arms_which_are_refused_beside_a_campaign(
    tmp_path: Path,
) -> None:
    real = real_cell(tmp_path)
    ask = {"action": StackRequest.RUN_CAMPAIGN, "seed_count": 1}
    assert "real arms at 10.0.0.6" in Switch(tmp_path, real).ask(**ask)
    switch = Switch(tmp_path)
    assert not switch.ask(**ask)
    start = {"action": StackRequest.START, "scenario": "real", "confirmed": ["10.0.0.6"]}
    assert "a campaign goes on" in switch.ask(**start)
    assert not switch.ask(action=StackRequest.CANCEL_CAMPAIGN)
    assert not switch.ask(**start)
    switch.close()


@pytest.mark.parametrize(
    "fields",
    [
        {"settings": ["rope" + ".a" * 1800 + "=1"]},
        {"settings": ["rope.length" + ".a" * 5 + "=1"]},
        {"settings": ["seed=" + "[" * 3000]},
        {"settings": ["seed=1"] * 100_000},
        {"settings": ["description='" + "x" * 4000 + "'"]},
        {"settings": ["name=" + "x" * 240]},
        {"settings": ["seed=0x" + "f" * 4000]},
        {"content": b"a" + b".a" * 30_000 + b"=1"},
        {"content": b"\0"},
        {"scenario": "x" * 4000},
    ],
    ids=range(10),
)
@pytest.mark.parametrize("action", [StackRequest.SAVE, StackRequest.START])
def test_hostile_request_is_refused_with_a_reason(
    tmp_path: Path, action: int, fields: dict[str, object]
) -> None:
    switch = Switch(tmp_path)
    assert switch.ask(action=action, name="abc", **fields)
    assert switch.door.refused == 1
    state = switch.state()
    # What the refusal quotes must not make it invalid itself.
    payload = state.SerializeToString()
    assert validation.decode(STACK_STATE, payload).last_request == "a"
    assert not switch.ask(action=action, name="abc", settings=["seed=1"])


def test_fault_of_the_program_while_a_request_is_handled_is_a_refusal(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    switch = Switch(tmp_path)

    def fail(*_: object) -> None:
        raise KeyError("x")

    monkeypatch.setattr(ScenarioLibrary, "save", fail)
    assert switch.ask(action=StackRequest.SAVE, name="abc") == "KeyError: 'x'"


def test_setting_of_a_deep_key_is_refused_by_the_number_of_its_parts(tmp_path: Path) -> None:
    settings = ["rope" + ".a" * 1800 + "=1"]
    refusal = Switch(tmp_path).ask(action=StackRequest.SAVE, name="abc", settings=settings)
    assert "1801" in refusal
