"""Photographs in the training of the network: which ones, and where their masks are believed."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from benchmarks.perception.network.photographs import known_mask, training_photographs
from benchmarks.perception.network.pictures import CROP_SIDE, UNLABELLED, random_crop
from benchmarks.perception.pictures.generators import rendered_picture
from lariat.perception.image.width import usual_width


def test_nothing_is_learnt_at_the_edge_of_a_mask_and_at_cables_without_one() -> None:
    picture = rendered_picture(1, 2, "plain")
    own, other = ((picture.labels == k).view(np.uint8) for k in (1, 2))
    known = known_mask(picture.color, own)
    kernel = np.ones((3, 3), np.uint8)
    assert np.all(known[cv2.morphologyEx(own, cv2.MORPH_GRADIENT, kernel) > 0] == UNLABELLED)
    assert np.mean(known[cv2.erode(other, kernel) > 0] == UNLABELLED) > 0.9
    assert np.mean(known[own > 0] == 1) > 0.3
    ground = cv2.dilate(own | other, kernel, iterations=8) == 0
    assert np.mean(known[ground] == 0) > 0.7


def test_a_mask_beside_a_cable_that_is_seen_is_not_believed() -> None:
    picture = rendered_picture(3, 1, "plain")
    cable = (picture.labels > 0).view(np.uint8)
    mask = np.roll(cable, round(0.8 * usual_width(cable)), axis=(0, 1))
    known = known_mask(picture.color, mask)
    beside = (mask > 0) & (cv2.dilate(cable, np.ones((3, 3), np.uint8)) == 0)
    assert np.mean(known[beside] == 1) < 0.02


def test_every_second_photograph_by_name_is_learnt_from(tmp_path: Path) -> None:
    pictures = [rendered_picture(k, 1, "plain") for k in range(3)]
    for name, picture in zip("cab", pictures, strict=True):
        cv2.imwrite(str(tmp_path / f"{name}.png"), picture.color[..., ::-1])
        cv2.imwrite(str(tmp_path / f"{name}.labels.png"), picture.labels)
    learnt = [color for color, _ in training_photographs(tmp_path)]
    assert len(learnt) == 2
    for color, k in zip(learnt, (1, 0), strict=True):
        assert np.array_equal(color, pictures[k].color)


def test_square_of_a_mask_says_where_nobody_knows() -> None:
    mask = np.zeros((300, 300), np.uint8)
    mask[100:], mask[200:] = 1, UNLABELLED
    shade = (100 * mask[..., None]).repeat(3, axis=2)
    for seed in range(5):
        color, square = random_crop(np.random.default_rng(seed), shade, mask)
        assert square.shape == (CROP_SIDE, CROP_SIDE)
        sure = np.isin(color[..., 0], (0, 100, 200))
        assert np.array_equal(square[sure], color[sure][:, 0] // 100)
