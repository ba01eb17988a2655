"""Checks of finished runs and campaigns."""

from __future__ import annotations

from shared import messages
from shared.messages.checks.values import MAX_NODES, Checks, check_length, check_places, count_nodes


def _check_run_curves(message: messages.RunCurves) -> None:
    count = len(message.time)
    check_length("error", message.error, count)
    check_length("clearance", message.clearance, count)


def _check_run_motion(message: messages.RunMotion) -> None:
    if message.node_count == 1 or message.node_count > MAX_NODES:
        raise ValueError(f"node_count = {message.node_count}; a rope has 2 to {MAX_NODES}")
    check_length("nodes", message.nodes, 3 * message.node_count * len(message.time))
    check_places("nodes", message.nodes)
    count_nodes("goal", message.goal)
    check_places("goal", message.goal)


def _check_campaign_state(message: messages.CampaignState) -> None:
    for trial in message.trials:
        check_length(f"values of seed {trial.seed}", trial.values, len(message.keys))


CHECKS: Checks = {
    messages.RunCurves: _check_run_curves,
    messages.RunMotion: _check_run_motion,
    messages.CampaignState: _check_campaign_state,
}
"""Check of each type of message."""
