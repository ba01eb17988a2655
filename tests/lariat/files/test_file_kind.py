"""Kinds of files, told by what is in them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cli.__main__ import main
from lariat.files.file_kind import kind_of

ROOT = Path(__file__).parents[3]


@pytest.mark.parametrize(
    ("file", "kind"),
    [
        ("README.md", "a text in Markdown"),
        ("tests/replay/camera.mcap", "a recording (MCAP)"),
        ("scenarios/cable.toml", "a TOML file, as scenarios are"),
        ("docs/guide/dashboard.png", "a PNG image"),
        ("missing", "a file that cannot be read"),
    ],
)
def test_a_file_is_named_by_its_content(file: str, kind: str):
    assert kind_of(ROOT / file) == kind


def test_an_archive_of_arrays_is_a_zip_whatever_its_name(tmp_path: Path):
    np.savez(tmp_path / "motion.npz", a=np.zeros(3))
    path = (tmp_path / "motion.npz").rename(tmp_path / "motion.md")
    assert "ZIP" in kind_of(path)


@pytest.mark.parametrize(
    ("head", "kind"), [(b"#ROSBAG V2.0\n\0", "ROS 1"), (b"SQLite format 3\0", "SQLite")]
)
def test_bags_are_named(head: bytes, kind: str, tmp_path: Path):
    (tmp_path / "a.mcap").write_bytes(head)
    assert kind in kind_of(tmp_path / "a.mcap")


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("identify", "README.md"), "README.md is a text in Markdown, not a .npz"),
        (("show", "README.md"), "README.md is a text in Markdown, not an MCAP file"),
        (("check", "docs/guide/dashboard.png"), "it is a PNG image, not a TOML file"),
        (("run", "README.md"), "README.md is a text in Markdown: not valid TOML"),
        (("certs", "README.md"), "README.md is a text in Markdown; name a folder"),
        (("see", "missing.png"), "cannot read missing.png: No such file"),
        (("calibrate", "README.md"), "lariat: README.md is a text in Markdown, not an MCAP file\n"),
        (("watch", "--port", "70000"), "port 70000 does not exist; give --port 0…65535"),
        (("show", "tests/replay/camera.mcap", "--port", "70000"), "port 70000 does not exist"),
        (("check", "cable", "--set", "rope.length=9999"), "rope.length = 9999.0 m is out of"),
        (("identify", "READM.md"), "did you mean 'README.md'?"),
        (("check", "three-cylinder"), "did you mean 'three-cylinders'?"),
        (("replay", "tests/replay/camera.mcp"), "did you mean 'tests/replay/camera.mcap'?"),
        (("replai", "x.mcap"), "did you mean 'replay'?"),
        (("bench", "goal"), "did you mean 'goals'?"),
    ],
)
def test_a_wrong_word_or_file_is_named_as_what_it_is(words, told, monkeypatch, capsys):
    monkeypatch.chdir(ROOT)
    assert main(list(words)) == 2
    assert told in capsys.readouterr().err
