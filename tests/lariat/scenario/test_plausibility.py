"""Doubts about values that are allowed, but plausible only by mistake."""

from __future__ import annotations

from pathlib import Path

import pytest

from lariat.scenario import load, parse
from lariat.scenario.plausibility import doubts
from lariat.scenario.shipped import shipped_names

TEXT = """
name = "doubted"
[rope]
length = 0.45
diameter = 0.008
linear_density = 0.044
youngs_modulus = 1.0e6
[start]
line = [[-0.2, 0.0, 0.3], [0.2, 0.0, 0.3]]
[goal]
line = [[-0.2, 0.1, 0.3], [0.2, 0.1, 0.3]]
[[obstacles]]
name = "post"
shape = "cylinder"
position = [0.0, 0.3, 0.1]
radius = 0.03
height = 0.2
[run]
tolerance = 0.002
"""


@pytest.mark.parametrize("name", shipped_names())
def test_no_shipped_scenario_is_doubted(name: str):
    assert doubts(load(name)) == ()


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        # Grams for kilograms, centimetres for metres.
        ("density = 0.044", "density = 4.4", "did you mean rope.linear_density = 0.44 kg/m or"),
        ("diameter = 0.008", "diameter = 0.08", "rope.diameter = 0.008 m"),
        ("diameter = 0.008", "diameter = 0.08", "rope.length is 5.62 times rope.diameter"),
        ("modulus = 1.0e6", "modulus = 2.0e11", "takes a force of 7.84e+03 N to bend"),
        ("modulus = 1.0e6", "modulus = 1.0e4", ""),
        ("modulus = 1.0e6", "modulus = 1.0e3", "did you mean rope.youngs_modulus = 10000 Pa"),
        ("diameter = 0.008", "diameter = 0.0008", "rope.diameter = 0.008 m"),
        ("density = 0.044", "density = 0.044\nstretch_stiffness = 2.0", "stretches by 9.71 %"),
        (
            "modulus = 1.0e6",
            "modulus = 4.0e9",
            "bends the rope, 157 N, changes its length by 35 mm",
        ),
        ("radius = 0.03", "radius = 5.0", "obstacle 'post' is 5 m large"),
        ("[0.0, 0.3, 0.1]", "[0.0, 9.0, 0.1]", "obstacle 'post' is 8.8 m away"),
        ("tolerance = 0.002", "tolerance = 0.05", "run.tolerance = 0.05 m is 11.1 %"),
    ],
)
def test_a_value_off_by_a_unit_is_doubted(tmp_path: Path, old: str, new: str, told: str):
    assert old in TEXT
    assert doubts(parse(TEXT, tmp_path)) == ()
    found = doubts(parse(TEXT.replace(old, new), tmp_path))
    assert told in " / ".join(found)
    assert bool(found) == bool(told)


def test_a_long_rope_and_a_thin_wire_are_plausible(tmp_path: Path):
    text = TEXT.replace("-0.2, ", "-4.9, ").replace("[0.2, ", "[4.9, ")
    text = text.replace("length = 0.45", "length = 10.0").replace("1.0e6", "1.0e5")
    text += "[limits]\nworkspace = [[-5, -5, -9], [5, 5, 9]]\n"
    assert doubts(parse(text, tmp_path)) == ()
    wire = TEXT.replace("0.45", "2.5").replace("0.008", "0.001").replace("1.0e6", "2.0e11")
    assert doubts(parse(wire.replace("0.044", "0.0062"), tmp_path)) == ()


def test_a_wire_that_its_weight_stretches_is_doubted(tmp_path: Path):
    wire = TEXT.replace("-0.2, ", "-4.925, ").replace("[0.2, ", "[4.925, ")
    wire = wire.replace("length = 0.45", "length = 10.0").replace("0.008", "0.002")
    wire = wire.replace("1.0e6", "2.0e11").replace("0.044", "0.0247")
    wire += "[limits]\nworkspace = [[-5, -5, -9], [5, 5, 9]]\n"
    (line,) = doubts(parse(wire, tmp_path))
    # The catenary's horizontal force is 3.96 N.
    assert "holds the rope between its grips, 3.95 N, changes its length by 20 mm" in line
    solid = wire.replace("[start]", "stretch_stiffness = 6.3e5\n[start]")
    assert doubts(parse(solid, tmp_path)) == ()


def test_a_camera_out_of_its_range_is_doubted(tmp_path: Path):
    text = TEXT + '[sensing]\nsource = "camera"\nposition = [0.0, 0.0, {}]\n'
    assert doubts(parse(text.format(1.2), tmp_path)) == ()
    (line,) = doubts(parse(text.format(12.0), tmp_path))
    assert "sensing.position" in line
    assert "11.7 m" in line
