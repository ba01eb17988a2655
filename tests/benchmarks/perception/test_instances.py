"""Judgement of detected ropes, and the fit of their doubt."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from benchmarks.perception.instances import bench
from benchmarks.perception.instances.calibration import fit_logistic
from benchmarks.perception.instances.judgement import dice_matrix
from benchmarks.perception.pictures.generators import tuning_picture


def test_dice_matrix_of_shifted_bars() -> None:
    truth, found = np.zeros((4, 40), np.uint8), np.zeros((4, 40), np.uint8)
    truth[0], truth[2] = 1, 2
    found[2, :30], found[3] = 1, 2
    assert np.allclose(dice_matrix(truth, found, 2, 2), [[0.0, 0.0], [60.0 / 70.0, 0.0]])


def test_logistic_fit_recovers_the_odds() -> None:
    random = np.random.default_rng(0)
    features = random.normal(size=(20_000, 2)) * [1.0, 5.0]
    odds = -0.5 + features @ [1.2, -0.1]
    wrong = random.random(20_000) < 1.0 / (1.0 + np.exp(-odds))
    assert np.allclose(fit_logistic(features, wrong), [-0.5, 1.2, -0.1], atol=0.06)


def test_labelled_photographs_are_measured(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    picture = tuning_picture(0, 1, "plain")
    cv2.imwrite(str(tmp_path / "one.png"), picture.color[..., ::-1])
    cv2.imwrite(str(tmp_path / "one.labels.png"), picture.labels)
    cv2.imwrite(str(tmp_path / "without-labels.png"), picture.color)
    assert bench.run(photographs=tmp_path, json=True) == 0
    (row,) = json.loads(capsys.readouterr().out)["rows"]
    assert (row["pictures"], row["count"]) == ("photographs, 1", 1)
    assert row["right_number"] == 1.0
    assert row["dice"] > 0.9


def test_folder_without_labels_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    cv2.imwrite(str(tmp_path / "one.png"), np.zeros((60, 60, 3), np.uint8))
    assert bench.run(photographs=tmp_path) == 2
    assert "labels" in capsys.readouterr().err
