"""Icons are those of viser, and its archive is opened once for all of them."""

from __future__ import annotations

import zipfile

import pytest
import viser
from viser import _gui_api, _gui_handles, _icons

from dashboard import icons

NAMES = (viser.Icon.TARGET, viser.Icon.TRASH, viser.Icon.PLAYER_PLAY)


def test_icons_are_those_of_viser_from_one_opening_of_its_archive(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    expected = [_icons.svg_from_icon(name) for name in NAMES]
    opened = []
    read_directory = zipfile.ZipFile._RealGetContents  # pyright: ignore[reportAttributeAccessIssue]

    def read_and_count(archive: zipfile.ZipFile) -> None:
        opened.append(archive)
        read_directory(archive)

    monkeypatch.setattr(zipfile.ZipFile, "_RealGetContents", read_and_count)
    icons.svg.cache_clear()
    icons._archive.cache_clear()
    icons.share_archive()

    for module in (_gui_api, _gui_handles):
        read = vars(module)["svg_from_icon"]
        assert [read(name) for name in NAMES] == expected
    assert len(opened) == 1


def test_an_unknown_icon_is_refused() -> None:
    with pytest.raises(KeyError, match=r"no-such-icon\.svg"):
        icons.svg("no-such-icon")  # pyright: ignore[reportArgumentType]
