"""What Lariat writes and serves, read by libraries of JavaScript.

The libraries are those of `package.json` in this folder; without them the tests are skipped:

    npm ci --ignore-scripts --prefix tests/javascript
"""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

HERE = Path(__file__).parent
NODE = shutil.which("node") or ""
needs_libraries = pytest.mark.skipif(
    not NODE or not (HERE / "node_modules").is_dir(),
    reason="no Node.js with the libraries; run: npm ci --ignore-scripts --prefix tests/javascript",
)


def run(script: str, *words: str) -> list[dict[str, Any]]:
    """Run a script of this folder, and return the objects that it prints."""
    command = [NODE, script, *words]
    done = subprocess.run(command, cwd=HERE, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    return [json.loads(line) for line in done.stdout.splitlines()]
