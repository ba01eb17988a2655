"""Campaigns: which trials are run, what becomes of them, and the table that is kept."""

from __future__ import annotations

import csv
import json
import os
import time
from pathlib import Path

import pytest

from lariat.configuration import ConfigurationError
from lariat.scenario import find, load
from shared.messages import CampaignState, CampaignTrial, StackRequest, Variation
from stack.scenario_manager.campaign.campaigns import Campaigns
from stack.scenario_manager.campaign.trial_scenarios import MAX_TRIALS, trial_scenarios

SCORE = {
    "reached": True,
    "reached_s": 2.5,
    "final_error_mm": 0.4,
    "max_node_error_mm": 0.6,
    "min_clearance_mm": None,
    "contact_time_s": 0.0,
    "replans": 1,
}
"""Score that a trial prints."""
WAIT = "import time; time.sleep(60)"
"""Program of a trial that does not end."""


def campaigns(folder: Path, program: str) -> Campaigns:
    return Campaigns(
        folder / "tables",
        folder / "trials",
        lambda trial: [
            *("-S", "-c", program, str(trial.scenario), str(trial.seed)),
            *(str(trial.stop_when_reached), trial.note, trial.recording),
        ],
    )


def request(seeds: int = 1, **values: list[str]) -> StackRequest:
    variations = [Variation(key=k.replace("__", "."), values=v) for k, v in values.items()]
    return StackRequest(seed_count=seeds, variations=variations)


def finished(each: Campaigns) -> CampaignState:
    deadline = time.monotonic() + 20.0
    while each.running and time.monotonic() < deadline:
        each.poll()
        time.sleep(0.01)
    assert each.state is not None
    assert not each.running
    return each.state


def test_every_combination_runs_with_every_seed_and_fills_a_row(tmp_path: Path) -> None:
    clearances = ["0.012", "0.02"]
    # The score names what the trial was given: its seed as its number of new paths.
    program = (
        "import json, os, sys\n"
        "text = open(sys.argv[1]).read()\n"
        f"score = json.loads({json.dumps(SCORE)!r})\n"
        "score['replans'] = int(sys.argv[2])\n"
        "score['contact_time_s'] = float(text.split('clearance = ')[1].split()[0])\n"
        "score['reached_s'] = os.nice(0)\n"
        "assert sys.argv[3] == 'True'\n"
        "print(json.dumps(score))"
    )
    each = campaigns(tmp_path, program)
    ask = request(2, control__clearance=clearances)
    ask.first_seed, ask.stop_when_reached = 7, True
    each.start(ask, find("three-cylinders"), "three-cylinders")
    state = finished(each)
    rows = [(t.values[0], t.seed, t.contact_time, t.replans) for t in state.trials]
    assert rows == [
        ("0.012", 7, 0.012, 7),
        ("0.012", 8, 0.012, 8),
        ("0.02", 7, 0.02, 7),
        ("0.02", 8, 0.02, 8),
    ]
    assert {t.reached_after for t in state.trials} == {19}
    table = list(csv.DictReader(Path(state.file).read_text().splitlines()))
    assert [row["control.clearance"] for row in table] == ["0.012", "0.012", "0.02", "0.02"]
    assert table[0]["error [m]"] == "0.0004"
    assert table[0]["min_clearance [m]"] == ""
    assert Path(state.file).parent.stat().st_mode & 0o077 == 0


def test_trial_is_told_its_note_and_recorded_where_that_is_asked_for(tmp_path: Path) -> None:
    told = tmp_path / "told"
    program = f"import sys; open({str(told)!r}, 'a').write('|'.join(sys.argv[4:]) + '\\n')"
    each = campaigns(tmp_path, program)
    ask = request(1, control__clearance=["0.012", "0.02"])
    each.start(ask, find("three-cylinders"), "three-cylinders")
    name = finished(each).name
    ask.record = True
    each.start(ask, find("three-cylinders"), "three-cylinders")
    recorded = finished(each).name
    assert told.read_text().splitlines() == [
        f"{name}: seed 0, control.clearance = 0.012|",
        f"{name}: seed 0, control.clearance = 0.02|",
        f"{recorded}: seed 0, control.clearance = 0.012|{recorded}_0.mcap",
        f"{recorded}: seed 0, control.clearance = 0.02|{recorded}_1.mcap",
    ]


def test_broken_trial_is_named_and_the_rest_goes_on(tmp_path: Path) -> None:
    program = (
        f"import sys\nif sys.argv[2] == '0': sys.exit('boom')\nprint('''{json.dumps(SCORE)}''')"
    )
    each = campaigns(tmp_path, program)
    each.start(request(2), find("three-cylinders"), "three-cylinders")
    first, second = finished(each).trials
    assert (first.state, first.reason) == (CampaignTrial.BROKEN, "boom")
    assert (second.state, second.reached) == (CampaignTrial.DONE, True)


def test_canceled_campaign_leaves_no_process_and_keeps_its_table(tmp_path: Path) -> None:
    pid = tmp_path / "pid"
    each = campaigns(
        tmp_path, f"import os; open({str(pid)!r}, 'w').write(str(os.getpid())); {WAIT}"
    )
    each.start(request(3), find("three-cylinders"), "three-cylinders")
    each.poll()
    with pytest.raises(ConfigurationError, match="a campaign goes on"):
        each.start(request(), find("three-cylinders"), "three-cylinders")
    deadline = time.monotonic() + 10.0
    while not (pid.exists() and pid.read_text()) and time.monotonic() < deadline:
        time.sleep(0.01)
    each.cancel()
    with pytest.raises(ProcessLookupError):
        os.kill(int(pid.read_text()), 0)
    assert each.state is not None
    assert {t.state for t in each.state.trials} == {CampaignTrial.CANCELED}
    assert Path(each.state.file).read_text().count("canceled") == 3
    with pytest.raises(ConfigurationError, match="no campaign"):
        each.cancel()


@pytest.mark.parametrize(
    ("ask", "words"),
    [
        (request(0), "0 trials"),
        (request(MAX_TRIALS, control__clearance=["0.01", "0.02"]), "400 trials"),
        (request(1, control__clearance=["5"]), "out of bounds"),
        (request(1, control__method=['"os:system"']), "names a class"),
        (request(1, seed=["1"]), "seed varies twice"),
        (request(1, a=["1"], b=["1"], c=["1"], d=["1"]), "4 settings vary"),
        (StackRequest(seed_count=1, first_seed=2**32 - 1), "first_seed"),
    ],
)
def test_bad_campaign_is_refused_at_once(tmp_path: Path, ask: StackRequest, words: str) -> None:
    with pytest.raises(ConfigurationError, match=words):
        list(trial_scenarios(ask, find("three-cylinders")))


def test_campaign_changes_no_scenario_file(tmp_path: Path) -> None:
    before = load("three-cylinders").text
    list(trial_scenarios(request(1, control__clearance=["0.02"]), find("three-cylinders")))
    assert load("three-cylinders").text == before
