"""Table of a campaign as CSV: a row for each trial, quantities in SI units.

The launcher keeps it as a file, and the page offers it for download.
"""

from __future__ import annotations

import csv
import io
import json
import math

from shared.messages import CampaignState, CampaignTrial

COLUMNS = (
    ("state", ""),
    ("reached", ""),
    ("reached_after", "s"),
    ("error", "m"),
    ("max_node_error", "m"),
    ("min_clearance", "m"),
    ("contact_time", "s"),
    ("replans", ""),
    ("wall", "s"),
    ("reason", ""),
)
"""Fields of a trial after its seed and its values, with their units."""


def campaign_csv(campaign: CampaignState) -> str:
    """Return the table of a campaign; what a trial does not have is left empty."""
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    heads = [f"{name} [{unit}]" if unit else name for name, unit in COLUMNS]
    rows.writerow(["scenario", "seed", *campaign.keys, *heads])
    for trial in campaign.trials:
        cells = [_cell(trial, name) for name, _ in COLUMNS]
        rows.writerow([campaign.scenario, trial.seed, *map(_plain, trial.values), *cells])
    return text.getvalue()


def _plain(value: str) -> str:
    """Value in TOML, a text without its quotes."""
    return json.loads(value) if value.startswith('"') else value


def _cell(trial: CampaignTrial, name: str) -> str:
    value = getattr(trial, name)
    if name == "state":
        return CampaignTrial.State.Name(value).lower()
    if name in ("reason", "wall"):
        return f"{value:.1f}" if name == "wall" else value
    if trial.state != CampaignTrial.DONE:
        return ""
    if isinstance(value, bool):
        return str(value).lower()
    return "" if math.isnan(value) else f"{value:.7g}"
