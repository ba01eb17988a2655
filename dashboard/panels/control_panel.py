"""Tab of the controller: the settings that act while the cell runs, and what the horizon costs."""

from __future__ import annotations

import math
from functools import partial

import viser

from dashboard import palette
from dashboard.action_queue import ActionQueue
from dashboard.markup import note_html
from dashboard.outbox import Outbox
from dashboard.panels.scenario.setting_fields import SettingField, sections
from lariat.configuration import parse_value
from lariat.controllers import live_keys
from lariat.scenario import Scenario
from lariat.trajectory import SECOND
from shared.messages import TaskRequest, TaskState

INTRODUCTION = (
    "These act at once, in a run too; a change of clearance or pace lets the rope rest until there "
    "is another path. All other settings start the cell again: tab Scenario."
)
SEND_PERIOD = SECOND // 4
"""Least time between two requests of one setting, whose slider is being dragged [ns]."""
SLIDER_SPAN = 100.0
"""Ratio of largest and default value up to which a number is a slider [-]."""
SLIDER_STEPS = 100
"""Least number of steps of a slider of real numbers [-]."""
ADAPT = "adapt"
"""Setting of a switch of its own, in the tab Rope."""


class ControlPanel:
    """A slider or field for each setting of the controller that acts while the cell runs."""

    def __init__(
        self, gui: viser.GuiApi, scenario: Scenario, actions: ActionQueue, outbox: Outbox
    ) -> None:
        self._outbox = outbox
        self._shown_task = -1, ""
        """Revision and last request of the task that the fields show."""
        self._unsent: dict[str, float] = {}
        """Values that people have chosen and that are not yet sent, by key."""
        self._sent_time = 0
        gui.add_html(note_html(INTRODUCTION))
        by_key = {f.key: f for fields in sections(scenario).values() for f in fields}
        keys = [key for key in live_keys(scenario.control) if key != ADAPT]
        self._defaults = {key: float(parse_value(by_key[f"control.{key}"].value)) for key in keys}
        self._fields = {key: _add(gui, by_key[f"control.{key}"]) for key in keys}
        for key, handle in self._fields.items():
            actions.on_change(handle, partial(self._take, key))
        self._reset = gui.add_button(
            "Back to the scenario's values",
            icon=viser.Icon.ARROW_BACK_UP,
            color=palette.NEUTRAL,
            visible=False,
        )
        self._reset.on_click(lambda _: actions.put(self._restore))

    def _take(self, key: str, value: float) -> None:
        if math.isfinite(float(value)):
            self._unsent[key] = value

    def _restore(self) -> None:
        for key, handle in self._fields.items():
            if handle.value != self._defaults[key]:
                handle.value = self._unsent[key] = type(handle.value)(self._defaults[key])

    def update(self, task: TaskState | None, now: int) -> None:
        """Send what people have changed, and show the controller's values."""
        if self._unsent and not 0 <= now - self._sent_time < SEND_PERIOD:
            self._sent_time = now
            for key, value in self._unsent.items():
                label = f"{key} = {value:g}"
                self._outbox.request_task(TaskRequest.SET, label, key=key, value=repr(value))
            self._unsent.clear()
        if task is None or (task.revision, task.last_request) == self._shown_task:
            return
        self._shown_task = task.revision, task.last_request
        for key, handle in self._fields.items():
            if key in task.settings and key not in self._unsent:
                handle.value = type(handle.value)(parse_value(task.settings[key]))
        changed = any(h.value != self._defaults[key] for key, h in self._fields.items())
        self._reset.visible = changed


def _add(gui: viser.GuiApi, field: SettingField) -> viser.GuiSliderHandle | viser.GuiNumberHandle:
    """Add a slider or, where the bounds are too wide for one, a field."""
    value, bounds = parse_value(field.value), field.bounds
    whole = isinstance(value, int)
    name = field.name.replace("_", " ")
    label = f"{name} [{field.unit}]" if field.unit else name
    if bounds is not None and bounds.high <= SLIDER_SPAN * value:
        decade = 10.0 ** math.floor(math.log10(bounds.high - bounds.low))
        step = 1 if whole else decade / SLIDER_STEPS
        low, high = (int(b) if whole else b for b in (bounds.low, bounds.high))
        return gui.add_slider(label, low, high, step, value, hint=field.hint)
    step = 1 if whole else 10.0 ** math.floor(math.log10(value) - 1.0)
    return gui.add_number(
        label,
        value,
        min=bounds and bounds.low,
        max=bounds and bounds.high,
        step=step,
        hint=field.hint,
    )
