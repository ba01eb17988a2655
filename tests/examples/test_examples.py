"""Examples: each runs, finds what it says, and has its picture and its place in the guide."""

from __future__ import annotations

import json
import os
import runpy
import subprocess
import sys
import tempfile
import webbrowser
from pathlib import Path

import matplotlib as mpl
import pytest
from matplotlib.figure import Figure

from examples.pictures import EXAMPLES, PICTURES
from tests.examples.facts import IN_THE_WHEEL, NOTEBOOKS, check, code_of

FOLDER = EXAMPLES[0].parent / "notebooks"
PAGE = PICTURES.with_suffix(".md")
HERE = [path for path in EXAMPLES if path.name[:2] not in IN_THE_WHEEL]
"""Examples that test_wheel.py does not run."""
ARGUMENTS = {
    "11": {"methods": ("examples.methods.shape_servo:ShapeServo",)},
    "12": {"estimators": ("examples.methods.carried:Carried",)},
    "14": {"iterations": 3, "batch": 4},
}
"""Arguments that shorten an example."""


@pytest.mark.parametrize("example", HERE, ids=lambda path: path.stem)
def test_example_finds_what_it_says(example: Path, capsys: pytest.CaptureFixture[str]):
    mpl.use("Agg")
    number = example.name[:2]
    figure = runpy.run_path(str(example))["main"](**ARGUMENTS.get(number, {}))
    assert isinstance(figure, Figure)
    check(number, capsys.readouterr().out)


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_example_is_shown_in_the_guide(example: Path):
    page = PAGE.read_text()
    assert f"(../../examples/{example.name})" in page
    assert f"(examples/{example.stem}.png)" in page
    assert (PICTURES / f"{example.stem}.png").is_file()
    assert 20 <= len(example.read_text().splitlines()) <= 70


@pytest.mark.parametrize("name", sorted(set(NOTEBOOKS) - set(IN_THE_WHEEL)))
def test_notebook_finds_what_it_says(
    name: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
):
    mpl.use("Agg")
    monkeypatch.chdir(tmp_path)
    shown: list[str] = []
    monkeypatch.setattr(webbrowser, "open", shown.append)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    exec(compile(code_of(FOLDER / f"{name}.ipynb"), name, "exec"), {"__name__": name})
    check(name, capsys.readouterr().out)
    assert len(shown) == (name == "run")
    for address in shown:
        assert "__VISER_EMBED_DATA__" in Path(address.removeprefix("file://")).read_text()


@pytest.mark.parametrize("file", sorted(FOLDER.glob("*.ipynb")), ids=lambda path: path.stem)
def test_notebook_is_short_without_outputs_and_in_the_guide(file: Path):
    book = json.loads(file.read_text())
    assert book["nbformat"] == 4
    assert len(book["cells"]) < 10
    code = [cell for cell in book["cells"] if cell["cell_type"] == "code"]
    assert not any(cell["outputs"] or cell["execution_count"] for cell in code)
    assert file.stem in NOTEBOOKS
    assert f"(../../examples/notebooks/{file.name})" in PAGE.read_text()


def test_example_runs_from_the_clone_as_a_script(tmp_path: Path):
    command = [sys.executable, str(EXAMPLES[0])]
    environment = {**os.environ, "MPLBACKEND": "Agg"}
    subprocess.run(command, cwd=tmp_path, env=environment, check=True)
    assert (tmp_path / f"{EXAMPLES[0].stem}.png").is_file()
