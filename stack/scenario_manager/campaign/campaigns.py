"""Campaigns of a stack: one at a time, one trial after the other, beside the live cell."""

from __future__ import annotations

import logging
import re
import shutil
import time
from datetime import UTC, datetime
from pathlib import Path

from lariat.configuration import ConfigurationError
from services.recorder.runs.run_folder import MAX_NOTE_LENGTH
from shared.campaign_table import campaign_csv
from shared.messages import CampaignState, CampaignTrial, StackRequest
from stack.scenario_manager.campaign.trial_process import Command, TrialOptions, TrialProcess
from stack.scenario_manager.campaign.trial_scenarios import trial_scenarios
from stack.scenario_manager.library import write

log = logging.getLogger(__name__)

MAX_WORD_LENGTH = 60
"""Largest length of a scenario's name in the name of a table [characters]."""


class Campaigns:
    """The campaign that goes on, or the last one."""

    def __init__(self, tables: Path, staging: Path, command: Command) -> None:
        self._tables, self._staging, self._command = tables, staging, command
        self._state: CampaignState | None = None
        self._scenarios: list[Path] = []
        """Scenario file of each trial."""
        self._request = StackRequest()
        self._process: TrialProcess | None = None
        self._present: CampaignTrial | None = None

    @property
    def state(self) -> CampaignState | None:
        """State to publish; None before the first campaign."""
        return self._state

    @property
    def running(self) -> bool:
        """Whether a campaign goes on."""
        return self._state is not None and self._state.running

    def start(self, request: StackRequest, base: Path, scenario: str) -> None:
        """Start a campaign."""
        if self.running:
            raise ConfigurationError("a campaign goes on; wait for its end, or cancel it")
        groups = list(trial_scenarios(request, base))
        shutil.rmtree(self._staging, ignore_errors=True)
        word = re.sub(r"[^A-Za-z0-9.-]+", "-", scenario)[:MAX_WORD_LENGTH]
        campaign = CampaignState(
            name=f"{datetime.fromtimestamp(time.time(), UTC):%Y-%m-%d_%H-%M-%S}_{word}",
            scenario=scenario,
            setting_count=len(request.settings),
            keys=[variation.key for variation in request.variations],
            running=True,
        )
        self._scenarios = []
        for k, group in enumerate(groups):
            path = write(group.scenario, self._staging / str(k), "scenario")
            for seed in group.seeds:
                campaign.trials.add(seed=seed, values=group.values)
                self._scenarios.append(path)
        self._state, self._request = campaign, request

    def cancel(self) -> None:
        """End the campaign; its finished trials stay."""
        if not self.running:
            raise ConfigurationError("no campaign goes on")
        self.close()

    def poll(self) -> bool:
        """Take the score of a trial that has ended, and start the next one."""
        campaign = self._state
        if campaign is None or not campaign.running:
            return False
        if self._process is not None and self._present is not None:
            if not self._process.take_end(self._present):
                return False
            self._process = self._present = None
        for number, trial in enumerate(campaign.trials):
            if trial.state == CampaignTrial.WAITING:
                self._begin(campaign, number)
                break
        else:
            campaign.running = False
        self._write(campaign)
        return True

    def close(self) -> None:
        """End the trial that goes on, and the campaign with it."""
        if self._process is not None:
            self._process.kill()
            self._process = self._present = None
        if (campaign := self._state) is None or not campaign.running:
            return
        campaign.running = False
        for trial in campaign.trials:
            if trial.state in (CampaignTrial.WAITING, CampaignTrial.RUNNING):
                trial.state = CampaignTrial.CANCELED
        self._write(campaign)

    def _begin(self, campaign: CampaignState, number: int) -> None:
        trial, path = campaign.trials[number], self._scenarios[number]
        trial.state = CampaignTrial.RUNNING
        options = TrialOptions(
            path,
            trial.seed,
            self._request.stop_when_reached,
            trial_note(campaign, trial),
            f"{campaign.name}_{number}.mcap" if self._request.record else "",
        )
        self._process, self._present = TrialProcess(self._command(options), path.parent), trial

    def _write(self, campaign: CampaignState) -> None:
        """Write the table; a disk that is full must not end the campaign."""
        try:
            # Like the recordings, for the owner alone.
            self._tables.mkdir(mode=0o700, parents=True, exist_ok=True)
            path = self._tables / f"{campaign.name}.csv"
            part = path.with_suffix(".part")
            part.write_text(campaign_csv(campaign))
            part.replace(path)
            campaign.file = str(path)
        except OSError as error:
            campaign.file = ""
            log.error("the table of the campaign %s cannot be written: %s", campaign.name, error)


def trial_note(campaign: CampaignState, trial: CampaignTrial) -> str:
    """Return the note of a trial in the list of runs: campaign, seed and values."""
    values = [f"{k} = {v}" for k, v in zip(campaign.keys, trial.values, strict=True)]
    return ", ".join([f"{campaign.name}: seed {trial.seed}", *values])[:MAX_NOTE_LENGTH]
