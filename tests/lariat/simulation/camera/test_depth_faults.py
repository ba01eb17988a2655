"""Holes, bleeding edges, interference and warm-up of the simulated depth images."""

from __future__ import annotations

import numpy as np
import pytest

from lariat.simulation.camera.depth_faults import REAL_SENSOR, DepthFaults

DEPTH = np.full((240, 320), 900, np.uint16)
GREY = np.full((240, 320, 3), 100, np.uint8)


def test_no_fault_is_on_by_default() -> None:
    np.testing.assert_array_equal(DepthFaults().apply(DEPTH, GREY, 1, 0), DEPTH)


@pytest.mark.parametrize("faults", [DepthFaults(dark_level=20), DepthFaults(glare_level=250)])
def test_dark_and_glaring_surfaces_have_holes_and_others_none(faults: DepthFaults) -> None:
    color = GREY.copy()
    color[:, :160] = 10 if faults.dark_level else 255
    depth = faults.apply(DEPTH, color, 1, 0)
    assert np.mean(depth[:, :160] == 0) == pytest.approx(faults.hole_share, abs=0.03)
    assert np.all(depth[:, 160:] > 0)


def test_near_depths_bleed_over_what_lies_behind() -> None:
    depth = DEPTH.copy()
    depth[:, 100:110] = 700
    bled = DepthFaults(bleed=2).apply(depth, GREY, 1, 0)
    np.testing.assert_array_equal(np.flatnonzero(bled[50] == 700), np.arange(98, 112))


def test_a_pixel_without_depth_gets_none_from_its_neighbours() -> None:
    depth = DEPTH.copy()
    depth[50, 50] = 0
    assert REAL_SENSOR.apply(depth, GREY, 1, 0)[50, 50] == 0


def test_bands_of_interference_wander() -> None:
    faults = DepthFaults(interference=0.003)
    first, later = (faults.apply(DEPTH, GREY, 1, frame).astype(float) for frame in (0, 6))
    assert np.std(first[:25]) > 1.5
    assert np.ptp(first[35:115]) == 0.0
    assert np.std(later[90:115]) > 1.5


def test_the_bias_of_a_cold_sensor_fades() -> None:
    faults = DepthFaults(warm_up_bias=0.008, warm_up_frames=100.0)
    offsets = [float(np.mean(faults.apply(DEPTH, GREY, 1, f)) - 900.0) for f in (0, 100, 1000)]
    assert offsets == pytest.approx([8.0, 3.0, 0.0], abs=0.51)


def test_a_frame_repeats_with_its_seed() -> None:
    one, again, other = (REAL_SENSOR.apply(DEPTH, GREY * 0, s, 3) for s in (1, 1, 2))
    np.testing.assert_array_equal(one, again)
    assert np.any(one != other)


def test_a_share_beyond_one_is_refused() -> None:
    with pytest.raises(ValueError, match=r"hole_share.*1\.5"):
        DepthFaults(hole_share=1.5)
