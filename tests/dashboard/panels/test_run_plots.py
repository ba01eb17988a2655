from __future__ import annotations

import pytest

from dashboard.panels.run_plots import result_text
from shared.messages import RunResult


@pytest.mark.parametrize(
    ("result", "text"),
    [
        (RunResult(run="a", reached=True), "Run a: reached"),
        (RunResult(run="a", reason="stopped"), "Run a: stopped"),
        (RunResult(run="a"), "Run a: not reached yet"),
        (RunResult(run="a", replans=1), "1 replan"),
        (RunResult(run="a", replans=2), "2 replans"),
        (RunResult(run="a", error=0.00123, max_node_error=0.004), "1.23 mm, largest 4.00 mm"),
    ],
)
def test_result_names_verdict_errors_and_replans(result: RunResult, text: str) -> None:
    assert text in result_text(result)
