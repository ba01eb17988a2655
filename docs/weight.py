"""Weight of the code base, counted from the files of the clone: `python docs/weight.py`.

Lines of Python by room, words of Markdown, and how many files name one thing: what a change of its
kind has to touch. Generated code (`*_pb2.py`) is left out. Standard library alone.
"""

from __future__ import annotations

import re
import subprocess
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).parents[1]
KINDS = {
    "obstacle shape": r"\bcone\b(?!=)|\bCONE\b",
    "identified rope parameter": r"\bdrag_coefficient\b|\bDRAG_COEFFICIENT\b",
    "flag of a goal": r"\bends_only\b",
    "topic": r"\bROPE_OTHERS\b|rope/others",
}
"""Pattern that finds the files that name one thing of a kind."""
FOREIGN_MEMORY = re.compile(r"ctypes\.(memmove|memset)|\bmprotect\b")
"""What writes over memory of another library; a process may name itself in its own arguments."""
PRIVATE_PARTS = re.compile(r"\b(viser|websockets|taichi|ti)(\.\w+)*\._[a-z]\w*")
"""What reads or replaces private parts of a dependency."""


def main() -> None:
    """Print the tables."""
    files = [ROOT / line for line in _git("ls-files").splitlines()]
    python = [f for f in files if f.suffix == ".py" and not f.name.endswith("_pb2.py")]
    lines = {f: len(_text(f).splitlines()) for f in python}
    tests = sum(n for f, n in lines.items() if _room(f).startswith("tests"))
    total = sum(lines.values())
    print(f"{'Python, all':40}{total:>8} lines in {len(python)} files")
    print(f"{'Python, without tests':40}{total - tests:>8}")
    rooms = Counter[str]()
    for file, count in lines.items():
        rooms[_room(file)] += count
    for room, count in sorted(rooms.items()):
        print(f"  {room:38}{count:>8}")
    words = sum(len(_text(f).split()) for f in files if f.suffix == ".md")
    print(f"{'Markdown':40}{words:>8} words")
    print("\nFiles that name one (tests and pages of documentation apart)")
    ours = [f for f in python if not _room(f).startswith(("tests", "docs"))]
    for kind, pattern in KINDS.items():
        names = [str(f.relative_to(ROOT)) for f in ours if re.search(pattern, _text(f))]
        print(f"  {kind:38}{len(names):>8}  {', '.join(sorted(names))}")
    print("\nOther libraries")
    for title, pattern in (
        ("writes over their memory", FOREIGN_MEMORY),
        ("uses of their private parts", PRIVATE_PARTS),
    ):
        places = [str(f.relative_to(ROOT)) for f in ours if pattern.search(_text(f))]
        places = [p for p in places if p != "stack/launcher/fork_server_process.py"]
        print(f"  {title:38}{len(places):>8}  {', '.join(places)}")


def _room(file: Path) -> str:
    """Folder that a file belongs to: two levels in library and services, else one."""
    top, *rest = file.relative_to(ROOT).as_posix().split("/")
    return f"{top}/{rest[0]}" if top in ("lariat", "services") and len(rest) > 1 else top


def _text(file: Path) -> str:
    return file.read_text(errors="replace") if file.is_file() else ""


def _git(*words: str) -> str:
    return subprocess.run(
        ["git", "-C", str(ROOT), *words], check=True, capture_output=True, text=True
    ).stdout


if __name__ == "__main__":
    main()
