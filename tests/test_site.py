"""Documentation as a site."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from benchmarks.benches import BENCHES
from cli.__main__ import VERBS

ROOT = Path(__file__).parents[1]


def test_site_builds_without_a_warning(tmp_path: Path):
    command = [sys.executable, "-m", "mkdocs", "build", "--quiet", "--site-dir", str(tmp_path)]
    environment = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "index.html").is_file()
    # A page of the reference is not empty: it documents what its module offers.
    for name, member in (("rod", "lariat.rod.Rod.rollout"), ("geometry", "lariat.geometry.Pose")):
        assert f'id="{member}"' in (tmp_path / "reference" / "library" / f"{name}.html").read_text()
    for page in (tmp_path / "reference" / "library").glob("*.html"):
        text = page.read_text()
        assert "doc-object doc-function" in text or "doc-object doc-class" in text, page.name
    commands = (tmp_path / "reference" / "commands.html").read_text()
    assert all(f'id="lariat-{verb}"' in commands for verb in VERBS)
    assert all(f'id="lariat-bench-{name}"' in commands for name in BENCHES)
