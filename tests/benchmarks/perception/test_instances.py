"""Judgement of detected ropes, and the fit of their doubt."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from benchmarks.perception.instances import bench
from benchmarks.perception.instances.calibration import fit_logistic, sample
from benchmarks.perception.instances.judgement import dice_matrix, right_lines
from benchmarks.perception.pictures.generators import rendered_picture
from benchmarks.tables import PrintOptions
from lariat.configuration import ConfigurationError
from lariat.perception.image.detector import DetectedRope
from lariat.perception.lines.ridge import Ridge
from tests.lariat.perception.image.test_p_wrong import SURE


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
    assert np.allclose(fit_logistic(features, wrong, np.ones(20_000)), [-0.5, 1.2, -0.1], atol=0.06)


def test_labelled_photographs_are_measured(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    picture = rendered_picture(0, 1, "plain")
    cv2.imwrite(str(tmp_path / "one.png"), picture.color[..., ::-1])
    cv2.imwrite(str(tmp_path / "one.labels.png"), picture.labels)
    cv2.imwrite(str(tmp_path / "without-labels.png"), picture.color)
    assert bench.run(photographs=tmp_path, options=PrintOptions(json=True)) == 0
    (row,) = json.loads(capsys.readouterr().out)["rows"]
    assert (row["pictures"], row["count"]) == ("photographs, 1", 1)
    assert row["right_number"] == 1.0
    assert row["dice"] > 0.9


def test_photographs_with_a_mask_for_each_cable_are_measured(
    tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    picture = rendered_picture(1, 2, "plain")
    cv2.imwrite(str(tmp_path / "two_1.png"), picture.color[..., ::-1])
    for k in (1, 2):
        mask = np.uint8(255) * (picture.labels == k)
        cv2.imwrite(str(tmp_path / f"two_1_mask_{k - 1}.png"), mask)
    assert bench.run(photographs=tmp_path, options=PrintOptions(json=True)) == 0
    (row,) = json.loads(capsys.readouterr().out)["rows"]
    assert (row["pictures"], row["count"]) == ("photographs, two", 1)
    assert row["one_line"] == 1.0


def test_a_line_that_goes_on_beyond_a_rope_is_not_right() -> None:
    labels = np.zeros((60, 200), np.uint8)
    labels[27:34, 20:90] = 1
    nothing = np.zeros(0)

    def rope(stop: float) -> DetectedRope:
        pixels = np.stack([np.arange(20.0, stop), np.full(int(stop) - 20, 30.0)], axis=1)
        return DetectedRope((0, 0, 0), 7.0, [Ridge(pixels, pixels, nothing, nothing)], SURE)

    right, on_rope = right_lines(labels, [rope(90.0), rope(180.0)])
    assert right.tolist() == [[True, False]]
    assert on_rope[1] < 0.6


def test_a_rope_without_label_that_the_border_cuts_off_is_not_taken_for_ground() -> None:
    picture = rendered_picture(1, 2, "plain")
    one = (picture.labels == 1).astype(np.uint8)
    complete, real = (sample("", picture.color, one, complete=c) for c in (True, False))
    assert complete is not None
    assert real is not None
    assert complete.known.all()
    cut_off = np.array([line.cut_off for line in real.lines]) > 0.0
    assert np.array_equal(~real.known, real.background & cut_off)
    assert not real.known.all()
    right = real.right.any(axis=0)
    assert right.sum() == 1
    assert real.known[right].all()


def test_folder_without_labels_is_refused(tmp_path: Path) -> None:
    cv2.imwrite(str(tmp_path / "one.png"), np.zeros((60, 60, 3), np.uint8))
    with pytest.raises(ConfigurationError, match="labels"):
        bench.run(photographs=tmp_path)
