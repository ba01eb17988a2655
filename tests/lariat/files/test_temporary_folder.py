from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from lariat.files.temporary_folder import MARK, TemporaryFolder


@pytest.fixture(autouse=True)
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Folder of this test's temporary folders."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


def _made_by_another_process(folder: Path) -> tuple[subprocess.Popen[str], Path]:
    code = (
        "from lariat.files.temporary_folder import TemporaryFolder\n"
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


def test_folder_is_its_owners_alone_and_is_removed() -> None:
    with TemporaryFolder("page-") as folder:
        assert folder.path.stat().st_mode & 0o777 == 0o700
        (folder.path / "file").touch()
    assert not folder.path.exists()
    folder.remove()


def test_folder_of_a_killed_process_is_removed_by_the_next_one(temporary: Path) -> None:
    process, left = _made_by_another_process(temporary)
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


def test_folder_of_an_older_version_stays(temporary: Path) -> None:
    """It has no lock, and its process may live."""
    old = temporary / "page-of-an-older-version"
    old.mkdir()
    with TemporaryFolder("page-"):
        assert old.exists()


def test_what_a_link_leads_to_stays(temporary: Path) -> None:
    target = temporary / "valuable"
    target.mkdir()
    (target / MARK).touch()
    (temporary / "page-link").symlink_to(target)
    with TemporaryFolder("page-"):
        assert target.exists()
