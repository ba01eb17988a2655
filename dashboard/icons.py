"""Icons of buttons and tabs, all read from one opening of viser's archive.

viser opens its archive anew for every icon, and reads the directory of its thousands of files: with
the icons of this page, half of the processor time of the dashboard's start.
"""

from __future__ import annotations

import functools
import zipfile

import viser
from viser import _gui_api, _gui_handles, _icons


def share_archive() -> None:
    """Let viser take its icons from `svg`."""
    for module in (_gui_api, _gui_handles):
        if not hasattr(module, "svg_from_icon"):
            raise RuntimeError(f"viser {viser.__version__}: {module.__name__} reads no icons")
        module.svg_from_icon = svg  # pyright: ignore[reportAttributeAccessIssue]


@functools.cache
def svg(name: viser.IconName) -> str:
    """Return an icon of `viser.Icon` as an `<svg>` element; KeyError where there is none."""
    return _archive().read(f"{name}.svg").decode()


@functools.cache
def _archive() -> zipfile.ZipFile:
    return zipfile.ZipFile(_icons.ICONS_DIR / "tabler-icons.zip")
