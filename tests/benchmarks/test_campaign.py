from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import pytest

from benchmarks.campaign import Campaign, success_interval


@dataclass(frozen=True)
class _Spec:
    number: int
    factor: float


@dataclass(frozen=True)
class _Trial:
    spec: _Spec
    product: float


RUNS: list[int] = []


def _run(spec: _Spec) -> _Trial:
    RUNS.append(spec.number)
    if spec.number == 2:
        raise ValueError("no scene [2]")
    return _Trial(spec, spec.number * spec.factor)


def _line(trial: _Trial) -> str:
    return f"number {trial.spec.number}"


CAMPAIGN = Campaign(_run, _Trial, _line)
SPECS = [_Spec(number, 1 / 1.5) for number in range(4)]


@pytest.fixture(autouse=True)
def _no_runs() -> None:
    RUNS.clear()


def test_a_campaign_goes_on_where_its_file_ends(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    results = tmp_path / "folder" / "trials.jsonl"
    first = CAMPAIGN.trials(SPECS[:3], results)
    results.write_text(results.read_text() + '{"spec": {"num')  # cut off
    CAMPAIGN.trials(SPECS, results)
    everything = CAMPAIGN.trials(SPECS, results)
    assert [t.spec.number for t in first] == [0, 1]
    assert RUNS == [0, 1, 2, 3]
    assert everything == [_run(SPECS[k]) for k in (0, 1, 3)]
    assert capsys.readouterr().err.splitlines() == [
        "number 0",
        "number 1",
        "no scene [2]",
        "number 3",
    ]


def test_another_factor_is_another_trial(tmp_path: Path) -> None:
    results = tmp_path / "trials.jsonl"
    CAMPAIGN.trials(SPECS[:1], results)
    CAMPAIGN.trials([_Spec(0, 1.5)], results)
    assert RUNS == [0, 0]


def test_several_processes_keep_the_order() -> None:
    trials = CAMPAIGN.trials(SPECS, workers=2)
    assert [t.spec.number for t in trials] == [0, 1, 3]


def test_the_interval_is_wilsons() -> None:
    low, high = success_interval(8, 10)
    z = 1.959964
    centre, half = (0.8 + z**2 / 20) / (1 + z**2 / 10), z / (1 + z**2 / 10)
    half *= (0.8 * 0.2 / 10 + z**2 / 400) ** 0.5
    assert (low, high) == pytest.approx((centre - half, centre + half), abs=1e-5)
