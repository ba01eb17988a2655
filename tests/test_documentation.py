"""Documentation: the files that it names exist, and its tables are those of the code."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from docs.generator.reference_pages import PATHS
from lariat.planning import preflight
from lariat.scenario import load, parse
from shared.topics import TOPICS

ROOT = Path(__file__).parents[1]
PAGES = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), *ROOT.glob("lariat/*.md")])
WRITTEN = {ROOT / "docs" / path for path in PATHS}
"""Pages that only the site has."""
FOLDERS = (
    "lariat|shared|services|dashboard|stack|environments|benchmarks|cli|scenarios|examples|tests|"
    "docs"
)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_every_file_that_a_page_names_exists(page: Path):
    text = page.read_text()
    links = {
        target for target in re.findall(r"\]\(([^)#\s]+)", text) if not re.match(r"[a-z]+:", target)
    }
    places = {link: (page.parent / link).resolve() for link in links}
    missing = {link for link, place in places.items() if not (place.exists() or place in WRITTEN)}
    named = set(re.findall(rf"`((?:{FOLDERS})/[\w./-]*)`", text))
    named -= {topic.key for topic in TOPICS}
    missing |= {name for name in named if not (ROOT / name).exists()}
    assert not missing


def test_the_cells_of_the_guide_are_in_order(tmp_path: Path):
    guide = ROOT / "docs" / "guide"
    (cell,), (region, goal, stretch, ends, board, arms, other_rope) = (
        re.findall(r"```toml\n(.*?)```", (guide / page).read_text(), re.DOTALL)
        for page in ("first-steps.md", "scenes.md")
    )
    assert set(preflight.check(parse(cell, tmp_path))) == {"start", "goal"}
    assert parse(cell + other_rope, tmp_path).control.adapt
    (tmp_path / "goal.csv").write_text("-0.2,0.2,0.3\n0.0,0.2,0.0946\n0.2,0.2,0.3\n")
    without_goal = re.sub(r"\[goal\].*?\n\n", goal + "\n", cell, flags=re.DOTALL)
    assert parse(without_goal, tmp_path).goal.nodes == "goal.csv"
    (tmp_path / "stretch.csv").write_text("-0.09,0.2,0.2\n0.0,0.2,0.2\n0.09,0.2,0.2\n")
    of_part = re.sub(r"\[goal\].*?\n\n", stretch + "\n", cell, flags=re.DOTALL)
    assert parse(of_part, tmp_path).goal.part == (0.12, 0.30)
    of_ends = re.sub(r"\[goal\].*?\n\n", ends + "\n", cell, flags=re.DOTALL)
    assert parse(of_ends, tmp_path).goal.ends_only
    shipped, named = tomllib.loads(load("harness-board").text), tomllib.loads(board)
    assert named["goal"] == shipped["goal"]
    assert named["clips"][0].items() <= shipped["clips"][0].items()
    assert tomllib.loads(arms)["ends"]["left"]["rotates"] is shipped["ends"]["left"]["rotates"]
    kept_in = parse(cell + region, tmp_path)
    assert [body.name for body in kept_in.regions] == ["tray"]
    assert set(preflight.check(kept_in)) == {"start", "goal"}


def test_the_script_of_the_page_on_python_runs_in_any_folder(tmp_path: Path):
    page = (ROOT / "docs" / "guide" / "python.md").read_text()
    script, moved = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    script = script.replace("range(8)", "range(2)").replace(
        '"control.adapt": True', '"control.adapt": True, "run.time_limit": 0.5'
    )
    (tmp_path / "script.py").write_text(script + f"    {moved}    run(moved)\n")
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "MPLBACKEND": "Agg"}
    command = [sys.executable, "script.py"]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    first, last = done.stdout.strip().splitlines()[0], done.stdout.strip().splitlines()[-1]
    assert first.startswith("the time limit has passed")
    assert len(last.split(",")) == 2
    assert {file.name for file in tmp_path.iterdir()} == {
        *("script.py", "run.mcap", "run.png", "run.html")
    }


def test_the_code_of_the_page_on_environments_runs(capsys: pytest.CaptureFixture[str]):
    page = (ROOT / "docs" / "guide" / "environments.md").read_text()
    for block in re.findall(r"```python\n(.*?)```", page, re.DOTALL):
        exec(compile(block, "environments.md", "exec"), {})
    assert 0.0 < float(capsys.readouterr().out.splitlines()[-1]) < 0.1


def test_the_messages_of_the_page_on_troubles_are_those_of_the_code():
    page = (ROOT / "docs" / "guide" / "troubleshooting.md").read_text()
    cells = [row.split("|")[1] for row in page.splitlines() if row.startswith("| `")]
    phrases = {phrase for cell in cells for phrase in re.findall(r"`([^`]+)`", cell)}
    folders = ("lariat", "shared", "services", "stack", "cli")
    files = [ROOT / "Makefile", *(f for folder in folders for f in (ROOT / folder).rglob("*.py"))]
    # A text that is wrapped in the code is one line.
    code = re.sub(r'"\s*f?"', "", "\n".join(file.read_text() for file in files))
    assert {phrase for phrase in phrases if phrase not in code} == set()
