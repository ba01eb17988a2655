"""Documentation as a site."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

from benchmarks.benches import BENCHES
from cli.__main__ import VERBS
from docs.generator.reference_pages import LIBRARY, PATHS

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
    for name, modules in LIBRARY.items():
        text = (tmp_path / "reference" / "library" / f"{name}.html").read_text()
        for module in modules:
            assert re.search(rf'id="{re.escape(module)}\.\w', text), module
    for path in PATHS:
        text = (tmp_path / path).with_suffix(".html").read_text()
        assert len(words_of_article(text)) > 100, path
    commands = (tmp_path / "reference" / "commands.html").read_text()
    assert all(f'id="lariat-{verb}"' in commands for verb in VERBS)
    assert all(f'id="lariat-bench-{name.replace(" ", "-")}"' in commands for name in BENCHES)


def words_of_article(page: str) -> list[str]:
    """Return the words of a page without its navigation."""
    article = page[page.index("<article") : page.index("</article>")]
    return re.sub(r"<[^>]+>", " ", article).split()
