"""Generator of `*_pb2.py` and `*_pb2.pyi` from the `.proto` files of this folder.

    python -m shared.messages.generate [FOLDER]

The generated code is checked in; a test compares it with newly generated code.
"""

from __future__ import annotations

import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
"""Folder of the repository."""


def generate(folder: Path) -> None:
    """Write the modules at the same relative paths as in the repository."""
    from grpc_tools import protoc

    files = [str(p.relative_to(ROOT)) for p in sorted(Path(__file__).parent.glob("*.proto"))]
    arguments = ["protoc", f"-I{ROOT}", f"--python_out={folder}", f"--pyi_out={folder}", *files]
    if protoc.main(arguments) != 0:
        raise ValueError(f"protoc refused {files}; see its message above")


if __name__ == "__main__":
    generate(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT)
