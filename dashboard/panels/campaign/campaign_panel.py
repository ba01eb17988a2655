"""Tab of campaigns: which trials to run, their progress, their table."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import viser

from dashboard import palette
from dashboard.action_queue import ActionQueue
from dashboard.markup import note_html
from dashboard.outbox import Notification, Outbox
from dashboard.panels.campaign.campaign_view import groups_html, progress_html, trials_html
from dashboard.panels.campaign.value_list import values_of
from dashboard.panels.scenario.setting_fields import SettingField, sections
from lariat.configuration import ConfigurationError
from lariat.scenario import Scenario
from shared.campaign_table import campaign_csv
from shared.messages import CampaignState, StackRequest, StackState, Variation

RUNNING = "(this one)"
"""Option of the list that stands for the scenario that runs."""
NOTHING = "(nothing)"
"""Option of the list of settings that stands for none."""
VARIATION_COUNT = 2
"""Number of settings that can vary together [-]."""
MAX_SEED_COUNT = 200
"""Largest number of seeds of a campaign [-]."""
ABOUT = (
    "Runs the scenario headless in simulated time, once for each seed and value, one trial after "
    "the other, while the live cell goes on. The tab Runs lists each trial."
)
NO_LAUNCHER = (
    "Nobody who runs campaigns answers: this stack was not started by lariat up. In a terminal, "
    "lariat run SCENARIO --seed N --json runs one trial."
)
"""Text while the state of the stack is missing."""


@dataclass(frozen=True)
class _VariationFields:
    """Setting that varies, and its values."""

    key: viser.GuiDropdownHandle[str]
    values: viser.GuiTextHandle


class CampaignPanel:
    """Fields of a campaign, and the state of the one that goes on or was last."""

    def __init__(
        self,
        gui: viser.GuiApi,
        scenario: Scenario,
        actions: ActionQueue,
        outbox: Outbox,
        notify: Callable[[Notification], None],
        changes: Callable[[], list[str] | None],
    ) -> None:
        """Add the elements to the page.

        `changes` returns the settings that people have changed, with the present goal and
        obstacles; None where one of them is not valid, which it has said.
        """
        self._actions, self._outbox, self._notify = actions, outbox, notify
        self._changes = changes
        self._fields: dict[str, SettingField] = {
            field.key: field for section in sections(scenario).values() for field in section
        }
        self._campaign: CampaignState | None = None
        self._problem = ""
        """Why the fields make no campaign; empty where they do."""
        self._about = gui.add_html(note_html(NO_LAUNCHER))
        self._scenario = gui.add_dropdown(
            "Scenario",
            (RUNNING,),
            hint="This one: with the tab Scenario's changes, the present goal and obstacles",
        )
        self._first_seed = gui.add_number("First seed", 0, min=0, max=2**30, step=1)
        self._seed_count = gui.add_number("Seeds", 10, min=1, max=MAX_SEED_COUNT, step=1)
        names = (NOTHING, *sorted(key for key in self._fields if key != "seed"))
        self._variations = []
        for number in range(1, VARIATION_COUNT + 1):
            also = " also" * (number > 1)
            key = gui.add_dropdown(f"Vary{also}", names)
            values = gui.add_text(
                f"Values{f' {number}' * (number > 1)}",
                "",
                hint="Values with commas between them, e.g. 0.01, 0.02",
            )
            self._variations.append(_VariationFields(key, values))
        self._stop_when_reached = gui.add_checkbox(
            "End each trial at its goal", True, hint="Otherwise it lasts until its time limit"
        )
        self._record = gui.add_checkbox(
            "Record each trial", False, hint="To open it in the tab Runs: about 7 MB a second"
        )
        self._summary = gui.add_html("")
        self._start = gui.add_button(
            "Run campaign", icon=viser.Icon.PLAYER_PLAY, color=palette.BRAND, disabled=True
        )
        self._cancel = gui.add_button(
            "Cancel campaign", icon=viser.Icon.X, color=palette.NEUTRAL, disabled=True
        )
        self._progress = gui.add_html(progress_html(None))
        self._groups = gui.add_html("", visible=False)
        self._trials = gui.add_html("", visible=False)
        self._download = gui.add_button(
            "Download table (CSV)", icon=viser.Icon.DOWNLOAD, disabled=True
        )
        self._start.on_click(lambda _: actions.put(self._request))
        self._cancel.on_click(lambda _: actions.put(self._request_cancel))
        actions.on_press(self._download, self._send)
        handles = (self._first_seed, self._seed_count)
        varied = [h for v in self._variations for h in (v.key, v.values)]
        for handle in (*handles, *varied):
            handle.on_update(lambda _: actions.put(self._show_summary))
        self._show_summary()

    def update(self, stack: StackState | None, campaign: CampaignState | None) -> None:
        """Show the scenarios that can be run and the state of the campaign."""
        names = () if stack is None else tuple(entry.name for entry in stack.scenarios)
        if tuple(self._scenario.options) != (RUNNING, *names):
            self._scenario.options = (RUNNING, *names)  # pyright: ignore[reportAttributeAccessIssue]
        self._about.content = note_html(NO_LAUNCHER if stack is None else ABOUT)
        running = campaign is not None and campaign.running
        self._start.disabled = stack is None or running or bool(self._problem)
        self._cancel.disabled = stack is None or not running
        if campaign is None or ((shown := self._campaign) and shown.stamp == campaign.stamp):
            return
        self._campaign = campaign
        self._download.disabled = False
        for handle, content in (
            (self._progress, progress_html(campaign)),
            (self._groups, groups_html(campaign)),
            (self._trials, trials_html(campaign)),
        ):
            handle.content, handle.visible = content, bool(content)

    def _read_variations(self) -> list[Variation]:
        """Return the settings that vary."""
        variations = []
        for each in self._variations:
            if each.key.value == NOTHING:
                continue
            if each.key.value in [variation.key for variation in variations]:
                raise ConfigurationError(f"{each.key.value} is chosen twice")
            field = self._fields[each.key.value]
            variations.append(Variation(key=field.key, values=values_of(field, each.values.value)))
        return variations

    def _show_summary(self) -> None:
        self._problem = ""
        try:
            variations = self._read_variations()
        except ConfigurationError as error:
            self._problem = str(error)
            self._summary.content = note_html(self._problem)
            self._start.disabled = True
            return
        count = int(self._seed_count.value)
        words = [f"{count} seed{'s' * (count > 1)}"]
        for variation in variations:
            count *= len(variation.values)
            words.append(f"{len(variation.values)} of {variation.key}")
        text = f"{' × '.join(words)} = {count} trial{'s' * (count > 1)}."
        self._summary.content = note_html(text)

    def _request(self) -> None:
        chosen = "" if self._scenario.value == RUNNING else self._scenario.value
        settings = [] if chosen else self._changes()
        if settings is None:
            return
        try:
            variations = self._read_variations()
        except ConfigurationError as error:
            self._notify(Notification("Campaign", str(error)))
            return
        self._outbox.request_stack(
            StackRequest.RUN_CAMPAIGN,
            "Campaign",
            scenario=chosen,
            settings=settings,
            variations=variations,
            first_seed=int(self._first_seed.value),
            seed_count=int(self._seed_count.value),
            stop_when_reached=self._stop_when_reached.value,
            record=self._record.value,
        )

    def _request_cancel(self) -> None:
        self._outbox.request_stack(StackRequest.CANCEL_CAMPAIGN, "Cancel campaign")

    def _send(self, client: viser.ClientHandle) -> None:
        if self._campaign is not None:
            content = campaign_csv(self._campaign).encode()
            client.send_file_download(f"{self._campaign.name}.csv", content, save_immediately=True)
