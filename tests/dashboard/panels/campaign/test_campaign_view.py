"""Progress and tables of a campaign: what they count, and what they leave out."""

from __future__ import annotations

import math
import re

from dashboard.panels.campaign.campaign_view import groups_html, progress_html, trials_html
from shared.messages import CampaignState, CampaignTrial


def campaign(**fields: object) -> CampaignState:
    state = CampaignState(scenario="rope", keys=["control.clearance"], running=True, **fields)
    common = {"state": CampaignTrial.DONE, "max_node_error": 0.0, "wall": 60.0}
    missed = {"reached": False, "reached_after": math.nan, "reason": "the time limit <has> passed"}
    for seed, error in enumerate((0.001, 0.002, 0.009)):
        trial = {"seed": seed, "values": ["0.01"], "error": error, "min_clearance": 0.02 - error}
        state.trials.add(**common, **trial, reached=True, reached_after=2.0 + seed)
    state.trials.add(
        **common, seed=0, values=["0.02"], error=0.05, min_clearance=math.nan, **missed
    )
    state.trials.add(seed=1, values=["0.02"])
    state.trials.add(seed=2, values=["0.02"], state=CampaignTrial.BROKEN, reason="boom")
    return state


def cells(table: str) -> list[list[str]]:
    rows = re.findall(r"<tr>(.*?)</tr>", table)
    return [re.findall(r"<t[dh][^>]*>(.*?)</t[dh]>", row) for row in rows]


def test_progress_counts_trials_goals_and_time() -> None:
    text = progress_html(campaign(setting_count=2))
    assert "rope with 2 changes" in text
    assert all(w in text for w in ("5 of 6", "3 reached", "1 broken", "60 s left"))
    assert "width:83.3%" in text


def test_canceled_trials_are_not_counted_as_done() -> None:
    state = campaign()
    state.running = False
    state.trials[4].state = CampaignTrial.CANCELED
    assert "canceled" in progress_html(state)


def test_each_combination_has_its_median_and_its_worst() -> None:
    _, first, second = cells(groups_html(campaign()))
    assert first == ["0.01", "3 of 3", "2.0 mm", "9.0 mm", "11.0 mm", "3.0 s"]
    assert second == ["0.02", "0 of 1", "50.0 mm", "50.0 mm", "–", "–"]


def test_campaign_that_varies_nothing_has_no_table_of_combinations() -> None:
    assert groups_html(CampaignState(trials=[CampaignTrial()])) == ""


def test_each_trial_has_its_row_with_its_reason() -> None:
    _, *rows = cells(trials_html(campaign()))
    assert rows[0] == ["0", "0.01", "reached", "1.0 mm", "19.0 mm", "2.0 s", "60 s"]
    assert rows[3][2:5] == ["not reached: the time limit &lt;has&gt; passed", "50.0 mm", "–"]
    assert rows[4][2:] == ["waits", "–", "–", "–", "–"]
    assert rows[5][2:4] == ["broken: boom", "–"]
