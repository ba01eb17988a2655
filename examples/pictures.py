"""Pictures of the examples, as `docs/guide/examples.md` shows them.

python -m examples.pictures [NUMBER ...]
"""

from __future__ import annotations

import runpy
import sys
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt

FOLDER = Path(__file__).parent
"""Folder of the examples."""
EXAMPLES = tuple(sorted(FOLDER.glob("[0-9][0-9]_*.py")))
"""Examples, in their order."""
PICTURES = FOLDER.parent / "docs" / "guide" / "examples"
"""Folder of the pictures."""


def main(numbers: list[str]) -> None:
    """Run examples and save their pictures.

    Args:
        numbers: Two digits of each example; without any, all are run.
    """
    mpl.use("Agg")
    for example in EXAMPLES:
        if numbers and example.name[:2] not in numbers:
            continue
        figure = runpy.run_path(str(example))["main"]()
        figure.savefig(PICTURES / f"{example.stem}.png", dpi=80, bbox_inches="tight")
        plt.close(figure)
        print(f"wrote {PICTURES / f'{example.stem}.png'}")


if __name__ == "__main__":
    main(sys.argv[1:])
