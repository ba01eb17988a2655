from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from shared.temporary_folder import TemporaryFolder


@pytest.fixture(autouse=True)
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Folder of this test's temporary folders."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


def _made_by_another_process(folder: Path) -> tuple[subprocess.Popen[str], Path]:
    code = (
        "from shared.temporary_folder import TemporaryFolder\n"
        "folder = TemporaryFolder('page-'); (folder.path / 'file').touch()\n"
        "print(folder.path, flush=True); input()\n"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", code],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "TMPDIR": str(folder)},
    )
    assert process.stdout is not None
    return process, Path(process.stdout.readline().strip())


def _age(folder: Path) -> None:
    os.utime(folder, (0.0, 0.0))


def test_folder_is_its_owners_alone_and_is_removed() -> None:
    with TemporaryFolder("page-") as folder:
        assert folder.path.stat().st_mode & 0o777 == 0o700
        (folder.path / "file").touch()
    assert not folder.path.exists()
    folder.remove()


def test_folder_of_a_killed_process_is_removed_by_the_next_one(temporary: Path) -> None:
    process, left = _made_by_another_process(temporary)
    _age(left)
    try:
        with TemporaryFolder("page-"):
            assert left.exists(), "its process lives"
    finally:
        process.kill()
        process.communicate()
    assert (left / "file").exists()
    with TemporaryFolder("other-"):
        assert left.exists(), "it has another prefix"
    with TemporaryFolder("page-"):
        assert not left.exists()


def test_young_folder_and_folder_without_a_lock_stay(temporary: Path) -> None:
    process, young = _made_by_another_process(temporary)
    process.kill()
    process.communicate()
    foreign = temporary / "page-of-somebody"
    foreign.mkdir()
    _age(foreign)
    with TemporaryFolder("page-"):
        assert young.exists()
        assert foreign.exists()


def test_what_a_link_leads_to_stays(temporary: Path) -> None:
    target = temporary / "valuable"
    target.mkdir()
    (target / ".owned").touch()
    (temporary / "page-link").symlink_to(target)
    _age(target)
    with TemporaryFolder("page-"):
        assert target.exists()
