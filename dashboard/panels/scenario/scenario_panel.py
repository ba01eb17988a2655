"""Tab of the scenario: choose and start one, change its settings, save, delete, exchange files."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import viser

from dashboard import palette
from dashboard.action_queue import ActionQueue
from dashboard.markup import escaped, note_html, paragraph_html
from dashboard.outbox import Notification, Outbox
from dashboard.panels.scenario.present_scene import goal_settings, obstacle_settings
from dashboard.panels.scenario.setting_editor import SettingEditor
from dashboard.uploads import Uploads
from lariat.files.toml_text import parse_toml
from lariat.geometry.obstacles import Obstacle
from lariat.scenario import SIDES, Scenario
from shared.messages import StackRequest, StackState, TaskState, goal_of
from shared.messages.validation import MAX_TEXT_LENGTH

NO_LAUNCHER = (
    "Nobody who starts scenarios answers: this stack was not started by lariat up. In containers, "
    "start another scenario with SCENARIO=NAME docker compose up --detach."
)
"""Text while the state of the stack is missing."""
START_TEXT = "The present cell ends; the page comes back by itself once the new one is ready."
"""Text of the dialog before a start."""
MAX_SHOWN_ADDRESSES = 300
"""Largest number of characters that the dialog shows of the addresses of real arms."""
RUNNING = "(this one)"
"""Option of the list that stands for the scenario that runs."""
OWN = "★ "
"""Mark of saved scenarios in the list."""


class ScenarioPanel:
    """List of scenarios, editor of the settings of the one that runs, and requests to the stack."""

    def __init__(
        self,
        gui: viser.GuiApi,
        scenario: Scenario,
        actions: ActionQueue,
        outbox: Outbox,
        notify: Callable[[Notification], None],
        uploads: Uploads,
    ) -> None:
        self._scenario, self._actions = scenario, actions
        self._outbox, self._notify = outbox, notify
        self._stack: StackState | None = None
        self._task: TaskState | None = None
        self._obstacles: Sequence[Obstacle] = scenario.bodies
        self._shown: bytes | None = b""
        self._saving = ("", "")
        """Id of the newest request to save, and the name that it gave."""
        self._status = gui.add_html(note_html(NO_LAUNCHER))
        self._choice = gui.add_dropdown("Scenario", (RUNNING,))
        self._choice.on_update(lambda _: actions.put(self._show_choice))
        self._description = gui.add_html(note_html(scenario.description))
        self._start = gui.add_button(
            "Start …",
            icon=viser.Icon.REFRESH,
            color=palette.BRAND,
            disabled=True,
            hint="End the present cell and start the chosen scenario, with the changes below",
        )
        actions.on_press(self._start, self._ask_start)
        self._delete = gui.add_button(
            "Delete …", icon=viser.Icon.TRASH, color=palette.NEUTRAL, visible=False
        )
        actions.on_press(self._delete, self._ask_delete)
        self._editor = SettingEditor(gui, scenario, actions)
        with gui.add_folder("Save", expand_by_default=True):
            self._name = gui.add_text("Name", "", hint="Small letters, digits, - and _")
            self._with_scene = gui.add_checkbox(
                "With the present goal and obstacles",
                True,
                hint="A goal is saved by its grips and turns",
            )
            save = gui.add_button("Save", icon=viser.Icon.DEVICE_FLOPPY)
            save.on_click(lambda _: actions.put(self._save))
            download = gui.add_button("Download file", icon=viser.Icon.DOWNLOAD)
            actions.on_press(download, self._send_file)
            upload = gui.add_upload_button("Start a file …", icon=viser.Icon.UPLOAD)
            upload.on_upload(
                lambda event: uploads.take(
                    event.target.value,
                    "a scenario",
                    _real_arms,
                    partial(self._take_file, event.target.value, event.client),
                )
            )

    def update(
        self, stack: StackState | None, task: TaskState | None, obstacles: Sequence[Obstacle]
    ) -> None:
        """Show the scenarios of the stack and the answer to the last request."""
        self._stack, self._task, self._obstacles = stack, task, obstacles
        shown = None if stack is None else stack.SerializeToString()
        if shown == self._shown:
            return
        self._shown = shown
        request, name = self._saving
        done = stack is not None and not stack.refusal and stack.last_request == request
        saved = name if name and done else ""
        self._status.content = (
            note_html(NO_LAUNCHER) if stack is None else status_html(stack, saved)
        )
        names = [] if stack is None else [f"{OWN * e.own}{e.name}" for e in stack.scenarios]
        options = (RUNNING, *names)
        if tuple(self._choice.options) != options:
            self._choice.options = options  # pyright: ignore[reportAttributeAccessIssue]
            self._show_choice()
        self._start.disabled = stack is None or bool(stack.activity)

    @property
    def _chosen(self) -> str:
        """Name of the chosen scenario; empty for the one that runs."""
        name = self._choice.value
        return "" if name == RUNNING else name.removeprefix(OWN)

    def _show_choice(self) -> None:
        entries = {} if self._stack is None else {e.name: e for e in self._stack.scenarios}
        entry = entries.get(self._chosen)
        text = entry.description if entry else self._scenario.description
        self._description.content = note_html(text)
        self._delete.visible = bool(entry and entry.own)

    def _ask_start(self, client: viser.ClientHandle) -> None:
        if self._has_problems():
            return
        if self._chosen:
            entries = self._stack.scenarios if self._stack else ()
            arms = [a for e in entries if e.name == self._chosen for a in e.real_arms]
            fields = {"scenario": self._chosen}
            title = self._chosen
        else:
            addresses = {self._editor.value(f"ends.{side}.address") for side in SIDES}
            arms = sorted(addresses - {""})
            fields = {"settings": self._editor.settings}
            title = self._scenario.name
            if count := len(self._editor.settings):
                title += f" with {count} change{'s' * (count > 1)}"
        self._confirm_start(client, title, arms, fields)

    def _take_file(
        self, file: viser.UploadedFile, client: viser.ClientHandle | None, arms: list[str]
    ) -> None:
        self._confirm_start(client, file.name, arms, {"content": file.content})

    def _confirm_start(
        self,
        client: viser.ClientHandle | None,
        title: str,
        arms: list[str],
        fields: dict[str, object],
    ) -> None:
        """Ask in the window where starting was pressed: the present cell ends."""
        if client is None:
            return
        paragraphs, word, color = [paragraph_html(START_TEXT)], "Start", palette.GOOD
        if arms:
            shown = ", ".join(arms)[:MAX_SHOWN_ADDRESSES]
            text = f"It drives the real arms at {shown}. Look at the cell."
            paragraphs.append(paragraph_html(text, weight=700))
            word, color = "Start real arms", palette.BAD
        request = partial(
            self._outbox.request_stack,
            StackRequest.START,
            f"Start {title}",
            confirmed=arms,
            **fields,
        )
        title = f"Start {title}?"
        self._actions.confirm(client, title, paragraphs, word, request, "Cancel", color)

    def _ask_delete(self, client: viser.ClientHandle) -> None:
        if not (name := self._chosen):
            return
        request = partial(
            self._outbox.request_stack, StackRequest.DELETE, f"Delete {name}", name=name
        )
        text = [paragraph_html("The saved scenario and its files.")]
        self._actions.confirm(client, f"Delete {name}?", text, "Delete", request)

    def changes(self, with_scene: bool = True) -> list[str] | None:
        """Return the settings that people changed; None, and say so, where one is not valid."""
        if self._has_problems():
            return None
        settings = self._editor.settings
        if with_scene:
            if self._task is not None:
                settings = settings + goal_settings(goal_of(self._task.goal), self._scenario)
            settings = settings + obstacle_settings(self._obstacles, self._scenario)
        if any(len(setting) > MAX_TEXT_LENGTH for setting in settings):
            text = "There are too many obstacles to save them from here; edit the file instead."
            self._notify(Notification("Obstacles", text))
            return None
        return settings

    def _save(self) -> None:
        name = self._name.value.strip()
        settings = [] if self._chosen else self.changes(self._with_scene.value)
        if settings is None:
            return
        request = self._outbox.request_stack(
            StackRequest.SAVE,
            f"Save {name}",
            scenario=self._chosen,
            settings=settings,
            name=name,
        )
        self._saving = (request, name)

    def _has_problems(self) -> bool:
        for problem in self._editor.problems.values():
            self._notify(Notification("Setting", problem))
            return True
        return False

    def _send_file(self, client: viser.ClientHandle) -> None:
        name, text = f"{self._scenario.name}.toml", self._scenario.text
        client.send_file_download(name, text.encode(), save_immediately=True)


def _real_arms(content: bytes) -> list[str]:
    """Addresses of the real arms that a scenario file names; what is malformed is the stack's."""
    ends = parse_toml(content.decode()).get("ends")
    addresses = set()
    for side in SIDES:
        end = ends.get(side) if isinstance(ends, dict) else None
        if isinstance(end, dict) and isinstance(address := end.get("address"), str) and address:
            addresses.add(address)
    return sorted(addresses)


def status_html(stack: StackState, saved: str = "") -> str:
    """HTML of the scenario that runs and of what became of the last request."""
    style = "margin:.5em 1em;font-size:.9em;line-height:1.4;overflow-wrap:anywhere"
    lines = [f"Runs: <b>{escaped(stack.scenario or '–')}</b>"]
    if stack.activity:
        color = palette.css(palette.BUSY)
        lines.append(f"<span style='color:{color}'>● {escaped(stack.activity)} …</span>")
    if saved:
        color = palette.css(palette.GOOD)
        text = f"saved as {escaped(saved)}, with a {OWN}in the list"
        lines.append(f"<span style='color:{color}'>● {text}</span>")
    if stack.refusal:
        color = palette.css(palette.BAD)
        lines.append(f"<span style='color:{color}'>● {escaped(stack.refusal)}</span>")
    return f"<div style='{style}'>{'<br>'.join(lines)}</div>"
