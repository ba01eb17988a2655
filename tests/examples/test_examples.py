"""Examples: each runs, finds what it says, and has its picture and its place in the guide."""

from __future__ import annotations

import os
import re
import runpy
import subprocess
import sys
from pathlib import Path

import matplotlib as mpl
import pytest
from matplotlib.figure import Figure

from examples.pictures import EXAMPLES, PICTURES

PAGE = PICTURES.with_suffix(".md")
FACTS = {
    "01": (r"0.35 +0. +(\S+)\] m$", 0.449, 0.451),  # height of the grip [m]
    "02": (r"target by (\S+) mm", 0.0, 2.0),
    "03": (r"stiffness: (\S+) ±", 0.9 * 0.007768, 1.1 * 0.007768),  # [m^4/s^2]
    "04": (r"buckling: (\S+) of Euler's", 0.998, 1.003),
    "05": (r"clearance (\S+) mm", 12.0, 40.0),
    "06": (r"mean error (\S+) mm", 0.0, 0.5),
    "07": (r"bending_stiffness: found (\S+),", 0.999 * 3.5e-4, 1.001 * 3.5e-4),  # [N m^2]
    "08": (r"to (\S+) mm", 0.0, 1.0),
    "09": (r"(\d+) differences", 0.0, 0.0),
    "10": (r"(\d+) of 1 as wanted", 1.0, 1.0),
    "11": (r"ShapeServo: error (\S+) mm", 0.0, 5.0),
    "12": (r"Carried: error (\S+) mm", 0.0, 5.0),
    "13": (r"error (\S+) mm", 0.0, 1.0),
    "14": (r"scene 1: error (\S+) mm", 0.0, 10.0),
    "15": (r"error (\S+) mm", 0.0, 0.5),
    "16": (r"keep_out: broken by (\S+) m", 0.04, 0.06),
}
"""Fact that each example prints, and its bounds."""
ARGUMENTS = {
    "10": {"count": 1, "workers": 1},
    "11": {"methods": ("examples.methods.shape_servo:ShapeServo",)},
    "12": {"estimators": ("examples.methods.carried:Carried",)},
    "14": {"iterations": 20},
}
"""Arguments that shorten an example."""


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_example_finds_what_it_says(example: Path, capsys: pytest.CaptureFixture[str]):
    mpl.use("Agg")
    number = example.name[:2]
    figure = runpy.run_path(str(example))["main"](**ARGUMENTS.get(number, {}))
    assert isinstance(figure, Figure)
    pattern, low, high = FACTS[number]
    found = re.search(pattern, capsys.readouterr().out, re.MULTILINE)
    assert found, pattern
    assert low <= float(found[1]) <= high


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_example_is_shown_in_the_guide(example: Path):
    page = PAGE.read_text()
    assert f"(../../examples/{example.name})" in page
    assert f"(examples/{example.stem}.png)" in page
    assert (PICTURES / f"{example.stem}.png").is_file()
    assert 20 <= len(example.read_text().splitlines()) <= 70


def test_example_runs_from_the_clone_as_a_script(tmp_path: Path):
    command = [sys.executable, str(EXAMPLES[0])]
    environment = {**os.environ, "MPLBACKEND": "Agg"}
    subprocess.run(command, cwd=tmp_path, env=environment, check=True)
    assert (tmp_path / f"{EXAMPLES[0].stem}.png").is_file()
