from __future__ import annotations

import pytest

from lariat.plain_text import is_plain, plain_text


@pytest.mark.parametrize(
    ("text", "plain"),
    [
        ("\x1b[2J\x1b[H", r"\x1b[2J\x1b[H"),
        ("50%\rdone\x07", r"50%\rdone\x07"),
        ("\x9b31m", r"\x9b31m"),
        ("exe\u202egnp", r"exe\u202egnp"),
        ("a\u2028b", r"a\u2028b"),
        ("Länge:\t3 °\nµ × → ★", "Länge:\t3 °\nµ × → ★"),
    ],
)
def test_control_characters_become_escapes_and_all_else_stays(text: str, plain: str) -> None:
    assert plain_text(text) == plain
    assert is_plain(plain)
    assert is_plain(text) == (text == plain)
