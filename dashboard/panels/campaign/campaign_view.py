"""Progress and tables of a campaign as HTML."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from dashboard import palette
from dashboard.controls.status_text import format_millimeters
from dashboard.markup import escaped, note_html, table_html
from dashboard.panels.campaign.value_list import plain_value
from shared.messages import CampaignState, CampaignTrial

DONE, BROKEN = CampaignTrial.DONE, CampaignTrial.BROKEN
OVER = (DONE, BROKEN)
"""States of trials that have come to their end."""
STATE_WORDS = {
    CampaignTrial.WAITING: "waits",
    CampaignTrial.RUNNING: "runs",
    BROKEN: "broken",
    CampaignTrial.CANCELED: "canceled",
}
"""Word for each state but DONE, for which the verdict stands."""
NO_CAMPAIGN = "No campaign has run since this stack was started."


def progress_html(campaign: CampaignState | None) -> str:
    """HTML of a bar and of a line: trials that are done, goals reached, time left."""
    if campaign is None:
        return note_html(NO_CAMPAIGN)
    trials = campaign.trials
    done = [t for t in trials if t.state == DONE]
    over = sum(t.state in OVER for t in trials)
    parts = [f"{over} of {len(trials)} trials", f"{sum(t.reached for t in done)} reached"]
    if contacts := sum(t.contact_time > 0.0 for t in done):
        parts.append(f"{contacts} touched something")
    if broken := sum(t.state == BROKEN for t in trials):
        parts.append(f"{broken} broken")
    if campaign.running and done:
        seconds = float(np.mean([t.wall for t in done])) * (len(trials) - over)
        parts.append(
            f"about {seconds / 60.0:.0f} min left"
            if seconds > 90
            else f"about {seconds:.0f} s left"
        )
    if not campaign.running:
        parts.append(
            "canceled" if any(t.state == CampaignTrial.CANCELED for t in trials) else "over"
        )
    title = campaign.scenario
    if count := campaign.setting_count:
        title += f" with {count} change{'s' * (count > 1)}"
    file = f"<br><span style='opacity:.7'>{escaped(campaign.file)}</span>" * bool(campaign.file)
    share = 100.0 * over / max(len(trials), 1)
    return (
        "<div style='margin:.5em 1em;font-size:.85em;line-height:1.5;overflow-wrap:anywhere'>"
        f"<b>{escaped(title)}</b><br>{escaped(' · '.join(parts))}{file}"
        f"<div style='height:6px;border-radius:3px;background:{palette.css(palette.QUIET, 0.3)}'>"
        f"<div style='height:6px;border-radius:3px;width:{share:.1f}%;"
        f"background:{palette.css(palette.BUSY)}'></div></div></div>"
    )


def groups_html(campaign: CampaignState | None) -> str:
    """HTML table of a row for each combination of values: medians and worst of its trials."""
    if campaign is None or not campaign.keys:
        return ""
    groups: dict[tuple[str, ...], list[CampaignTrial]] = {}
    for trial in campaign.trials:
        groups.setdefault(tuple(trial.values), []).append(trial)
    heads = [*map(_short, campaign.keys), "reached", "error", "worst", "min clearance", "after"]
    rows = []
    for values, trials in groups.items():
        done = [t for t in trials if t.state == DONE]
        errors = [t.error for t in done if math.isfinite(t.error)]
        clearances = [t.min_clearance for t in done if math.isfinite(t.min_clearance)]
        times = [t.reached_after for t in done if math.isfinite(t.reached_after)]
        cells = [
            *map(plain_value, values),
            f"{sum(t.reached for t in done)} of {len(done)}",
            format_millimeters(float(np.median(errors)) if errors else math.nan),
            format_millimeters(max(errors, default=math.nan)),
            format_millimeters(min(clearances, default=math.nan)),
            f"{np.median(times):.1f} s" if times else "–",
        ]
        rows.append(_row(cells, len(campaign.keys), palette.QUIET))
    return table_html(heads, "".join(rows), "160px")


def trials_html(campaign: CampaignState | None) -> str:
    """HTML table of a row for each trial, in the order in which they run."""
    if campaign is None:
        return ""
    heads = [
        "seed",
        *map(_short, campaign.keys),
        "verdict",
        "error",
        "min clearance",
        "after",
        "took",
    ]
    rows = []
    for trial in campaign.trials:
        done = trial.state == DONE
        verdict = STATE_WORDS.get(trial.state, "reached" if trial.reached else "not reached")
        color = palette.QUIET
        if done or trial.state == BROKEN:
            color = palette.GOOD if trial.reached else palette.WARNING if done else palette.BAD
        error, clearance = (trial.error, trial.min_clearance) if done else (math.nan, math.nan)
        after = trial.reached_after if done else math.nan
        cells = [
            str(trial.seed),
            *map(plain_value, trial.values),
            f"{verdict}{f': {trial.reason}' * bool(trial.reason)}",
            format_millimeters(error),
            format_millimeters(clearance),
            f"{after:.1f} s" if math.isfinite(after) else "–",
            f"{trial.wall:.0f} s" if trial.state in (DONE, BROKEN) else "–",
        ]
        rows.append(_row(cells, 1 + len(campaign.keys), color))
    return table_html(heads, "".join(rows), "260px")


def _short(key: str) -> str:
    return key.rpartition(".")[2].replace("_", " ")


def _row(cells: Sequence[str], verdict: int, color: palette.Color) -> str:
    """HTML of a row whose verdict, one of its cells, has a colour."""
    styles = ["white-space:nowrap"] * len(cells)
    styles[verdict] = f"color:{palette.text_css(color)}"
    pairs = zip(styles, cells, strict=True)
    row = "".join(f"<td style='{style}'>{escaped(text)}</td>" for style, text in pairs)
    return f"<tr>{row}</tr>"
