"""Editor of a scenario's settings: one section at a time, changes of all sections together."""

from __future__ import annotations

from functools import partial

import viser

from dashboard import palette
from dashboard.action_queue import ActionQueue
from dashboard.markup import escaped
from dashboard.panels.scenario.setting_fields import SettingField, sections
from lariat.configuration import ConfigurationError
from lariat.scenario import Scenario

Handle = viser.GuiCheckboxHandle | viser.GuiDropdownHandle[str] | viser.GuiTextHandle


class SettingEditor:
    """Fields of the chosen section, and the changes that people have made."""

    def __init__(self, gui: viser.GuiApi, scenario: Scenario, actions: ActionQueue) -> None:
        self._gui = gui
        self._actions = actions
        self._sections = sections(scenario)
        self._present = {
            field.key: field.value for section in self._sections.values() for field in section
        }
        self._texts: dict[str, str] = {}
        """Changed texts by their keys."""
        self._settings: dict[str, str] = {}
        """Settings of the changed texts that are valid, by their keys."""
        self.problems: dict[str, str] = {}
        """Reasons why changed texts are not valid, by their keys."""
        self._handles: list[Handle] = []
        self._choice = gui.add_dropdown("Section", tuple(self._sections))
        actions.on_change(self._choice, self._show)
        self._folder = gui.add_folder("Settings")
        self._summary = gui.add_html("")
        self._undo = gui.add_button(
            "Undo changes", icon=viser.Icon.ARROW_BACK_UP, color=palette.NEUTRAL, visible=False
        )
        self._undo.on_click(lambda _: actions.put(self._forget))
        self._show(self._choice.value)

    @property
    def settings(self) -> list[str]:
        """Settings that differ from the scenario's, `dotted.key=value` in TOML."""
        return list(self._settings.values())

    def value(self, key: str) -> str:
        """Return the text of a setting, changed or not; empty where the file has none."""
        return self._texts.get(key, self._present.get(key, ""))

    def _show(self, section: str) -> None:
        if section not in self._sections:
            return
        for handle in self._handles:
            handle.remove()
        with self._folder:
            self._handles = [self._add(field) for field in self._sections[section]]

    def _add(self, field: SettingField) -> Handle:
        label = field.name.replace("_", " ") + (f" [{field.unit}]" if field.unit else "")
        text = self.value(field.key)
        if field.options == ("true", "false"):
            box = self._gui.add_checkbox(label, text == "true", hint=field.hint)
            self._actions.on_change(box, lambda on: self._take(field, str(bool(on)).lower()))
            return box
        handle = (
            self._gui.add_dropdown(label, field.options, initial_value=text, hint=field.hint)
            if field.options
            else self._gui.add_text(label, text, hint=field.hint)
        )
        self._actions.on_change(handle, partial(self._take, field))
        return handle

    def _take(self, field: SettingField, text: str) -> None:
        for changes in (self._texts, self._settings, self.problems):
            changes.pop(field.key, None)
        if text != field.value:
            self._texts[field.key] = text
            try:
                self._settings[field.key] = field.setting(text)
            except ConfigurationError as error:
                self.problems[field.key] = str(error)
        self._show_summary()

    def _forget(self) -> None:
        for changes in (self._texts, self._settings, self.problems):
            changes.clear()
        self._show(self._choice.value)
        self._show_summary()

    def _show_summary(self) -> None:
        self._undo.visible = bool(self._texts)
        self._summary.content = summary_html(
            [(key, self._present[key], text) for key, text in self._texts.items()],
            list(self.problems.values()),
        )


def summary_html(changes: list[tuple[str, str, str]], problems: list[str]) -> str:
    """HTML of changed settings and of what is wrong with them."""
    style = "margin:.3em 1em;font-size:.8em;line-height:1.4;overflow-wrap:anywhere"
    lines = [
        f"<div><b>{escaped(key)}</b>: {escaped(old or '–')} → {escaped(new)}</div>"
        for key, old, new in changes
    ]
    color = palette.css(palette.BAD)
    lines += [f"<div style='color:{color}'>{escaped(text)}</div>" for text in problems]
    return f"<div style='{style}'>{''.join(lines)}</div>" if lines else ""
