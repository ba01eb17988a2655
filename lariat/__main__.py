"""Command `lariat`, which takes the clone: its wheel holds the library alone."""

from __future__ import annotations

import sys
from importlib import import_module
from importlib.util import find_spec


def main() -> int:
    """Run the command line and return its exit code."""
    if find_spec("cli") is None:
        print(
            "lariat: only the library is installed; the command runs in a clone, "
            "after pip install -e '.[all]' there",
            file=sys.stderr,
        )
        return 2
    return import_module("cli.__main__").main()


if __name__ == "__main__":
    sys.exit(main())
