from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import pytest

from benchmarks.campaign import CampaignOptions, Trial, success_interval


@dataclass(frozen=True)
class _Spec:
    number: int
    factor: float


RUNS: list[int] = []


def _run(spec: _Spec) -> Trial:
    RUNS.append(spec.number)
    if spec.number == 2:
        raise ValueError("no scene [2]")
    return {"product": spec.number * spec.factor}


SPECS = [_Spec(number, 1 / 1.5) for number in range(4)]


@pytest.fixture(autouse=True)
def _no_runs() -> None:
    RUNS.clear()


def test_a_campaign_goes_on_where_its_file_ends(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    results = tmp_path / "folder" / "trials.jsonl"
    first = CampaignOptions(results=results).trials(_run, SPECS[:3])
    results.write_text(results.read_text() + '{"spec": {"num')  # cut off
    CampaignOptions(results=results).trials(_run, SPECS)
    everything = CampaignOptions(results=results).trials(_run, SPECS)
    assert [t["spec"].number for t in first] == [0, 1]
    assert RUNS == [0, 1, 2, 3]
    assert everything == [{"spec": SPECS[k], **_run(SPECS[k])} for k in (0, 1, 3)]
    assert capsys.readouterr().err.splitlines() == [
        "0, 0.6666666666666666: product 0",
        "1, 0.6666666666666666: product 0.6667",
        "no scene [2]",
        "3, 0.6666666666666666: product 2",
    ]


def test_another_factor_is_another_trial(tmp_path: Path) -> None:
    results = tmp_path / "trials.jsonl"
    CampaignOptions(results=results).trials(_run, SPECS[:1])
    CampaignOptions(results=results).trials(_run, [_Spec(0, 1.5)])
    assert RUNS == [0, 0]


def test_several_processes_keep_the_order() -> None:
    trials = CampaignOptions(workers=2).trials(_run, SPECS)
    assert [t["spec"].number for t in trials] == [0, 1, 3]


def test_the_interval_is_wilsons() -> None:
    low, high = success_interval(8, 10)
    z = 1.959964
    centre, half = (0.8 + z**2 / 20) / (1 + z**2 / 10), z / (1 + z**2 / 10)
    half *= (0.8 * 0.2 / 10 + z**2 / 400) ** 0.5
    assert (low, high) == pytest.approx((centre - half, centre + half), abs=1e-5)
