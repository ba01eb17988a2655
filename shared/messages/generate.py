"""Generates `*_pb2.py` and `*_pb2.pyi` from the `.proto` files beside this one.

    python -m shared.messages.generate [FOLDER]

The generated code is checked in; a test regenerates it and compares.
"""

from __future__ import annotations

import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]


def generate(folder: Path) -> None:
    """Writes the modules below `folder`, at the same relative paths as in the repository."""
    from grpc_tools import protoc

    files = [str(p.relative_to(ROOT)) for p in sorted(Path(__file__).parent.glob("*.proto"))]
    arguments = ["protoc", f"-I{ROOT}", f"--python_out={folder}", f"--pyi_out={folder}", *files]
    if protoc.main(arguments) != 0:
        raise ValueError(f"protoc refused {files}; its message stands above")


if __name__ == "__main__":
    generate(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT)
