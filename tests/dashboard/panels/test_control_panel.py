from __future__ import annotations

from collections.abc import Iterator

import pytest
import viser

from dashboard.action_queue import ActionQueue
from dashboard.outbox import Outbox
from dashboard.panels.control_panel import SEND_PERIOD, ControlPanel
from dashboard.web.private_viser import PrivateViser
from lariat.control.run import live_settings
from lariat.controllers import live_keys
from lariat.scenario import load
from shared.messages import TaskState

SCENARIO = load("scenarios/three-cylinders.toml")
SETTINGS = live_settings.texts(SCENARIO.control, live_keys(SCENARIO.control))
NOW = 100 * SEND_PERIOD


class Panel(ControlPanel):
    """Panel of a page, with what it sends."""

    def __init__(self, private: PrivateViser) -> None:
        self.outbox = Outbox("a")
        super().__init__(private.server.gui, SCENARIO, ActionQueue(), self.outbox)

    def sent(self, now: int, task: TaskState | None = None) -> list[tuple[str, str]]:
        """Settings that the panel sends at a time."""
        self.update(task, now)
        return [(p.message.key, p.message.value) for p in self.outbox.take(now)]


@pytest.fixture
def panel() -> Iterator[Panel]:
    private = PrivateViser("test")
    yield Panel(private)
    private.close()


def test_every_live_setting_has_a_field_with_the_scenarios_value(panel: Panel) -> None:
    assert set(panel._fields) == set(SETTINGS) - {"adapt"}
    for key, handle in panel._fields.items():
        assert handle.value == pytest.approx(float(SETTINGS[key]))
        assert "Default: " in (handle.hint or "")
    assert isinstance(panel._fields["clearance"], viser.GuiSliderHandle)


def test_dragged_slider_is_sent_at_a_bounded_rate_and_its_last_value_wins(panel: Panel) -> None:
    panel._unsent["pace"] = 0.5
    assert panel.sent(NOW) == [("pace", "0.5")]
    for value in (0.6, 0.7):
        panel._unsent["pace"] = value
        assert panel.sent(NOW + SEND_PERIOD // 2) == []
    assert panel.sent(NOW + SEND_PERIOD) == [("pace", "0.7")]


def test_values_of_the_controller_are_shown_and_can_be_taken_back(panel: Panel) -> None:
    task = TaskState(revision=2, settings={**SETTINGS, "horizon": "8", "speed_weight": "0.5"})
    assert panel.sent(NOW, task) == []
    assert (panel._fields["horizon"].value, panel._fields["speed_weight"].value) == (8, 0.5)
    assert panel._reset.visible
    panel._restore()
    assert sorted(panel.sent(NOW + SEND_PERIOD)) == [("horizon", "5"), ("speed_weight", "0.02")]
    panel.sent(NOW, TaskState(revision=3, settings=SETTINGS))
    assert not panel._reset.visible
