"""Tables of numbers, as spreadsheets and other programs write them, are read alike."""

from __future__ import annotations

import re

import numpy as np
import pytest

from lariat.files.table import decode_text, read_table

VALUES = np.array([[-0.25, 1.5e-3, 0.3], [0.0, 0.125, -2.0], [1.0, 2.0, 3.0]])


def text(separator: str, point: str = ".", rows: np.ndarray = VALUES) -> str:
    lines = (separator.join(f"{v:.6f}".replace(".", point) for v in row) for row in rows)
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize(
    "content",
    [
        text(",").encode(),
        text(", ").encode(),
        text("\t").encode(),
        text("   ").encode(),
        text(";").encode(),
        text(";", ",").encode(),
        text("\t", ",").encode(),
        text(" ", ",").encode(),
        text(";", ",").replace("\n", ";\r\n").encode(),
        ("\ufeff" + text(",")).encode(),
        text(";", ",").encode("utf-16"),
        ("\ufeff" + text("\t")).encode("utf-16-be"),
        text("\t").encode("utf-16-le"),
        ("sep=;\n" + text(";", ",")).encode(),
        re.sub(r"[^|\n]+", r'"\g<0>"', text("|", ",")).replace("|", ",").encode(),
        ("# of a spreadsheet\n\n" + text(",")).encode(),
        ("x,y,z\n" + text(",")).encode(),
        ('"X [m]";"Y (m)";"Z"\n' + text(";", ",")).encode(),
        ("Länge;Höhe;Tiefe\n" + text(";", ",")).encode("cp1252"),
        text(",", rows=np.insert(VALUES, 0, [0, 1, 2], axis=1)).encode(),
        ("Nr;x;y;z\n" + text(";", ",", np.insert(VALUES, 0, [1, 2, 3], axis=1))).encode(),
        ("z [m],t,y [m],x [m]\n" + text(",", rows=np.insert(VALUES[:, ::-1], 1, 7, 1))).encode(),
    ],
)
def test_table_gives_its_numbers_in_the_wanted_order(content: bytes) -> None:
    np.testing.assert_allclose(read_table(content).columns("x", "y", "z"), VALUES, atol=1e-9)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"1,2,3\n4,5,six\n", "line 2: '4,5,six' is not a row of numbers"),
        (b"a,b,c\nd,e,f\n1,2,3\n", "line 2: 'd,e,f'"),
        (b"1,2,3\n\n4,5\n", "line 3: 2 numbers, 3 in line 1"),
        (b"1.234,5;2;3\n", "line 1: '1.234,5;2;3' is not a row of numbers"),
        (b"\x89PNG\r\n\x1a\n", "no text"),
        (b"# nodes\n1,2\n3,4\n", "line 2: 2 numbers instead of x, y, z"),
        (b"x,y,z\n", "no rows of numbers"),
        (b"5,1,2,3\n7,1,2,3\n", "line 1: 4 numbers instead of x, y, z"),
    ],
)
def test_what_is_no_such_table_is_refused_by_its_line(content: bytes, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        read_table(content).columns("x", "y", "z")


def test_empty_cell_is_not_a_number_and_rows_keep_their_lines() -> None:
    table = read_table(b"t;a\n\n0;1,5\n1;\n")
    assert table.names == ("t", "a")
    assert table.lines == (3, 4)
    np.testing.assert_array_equal(table.values, [[0.0, 1.5], [1.0, np.nan]])


def test_text_of_any_usual_encoding() -> None:
    for encoding in ("utf-8", "utf-8-sig", "utf-16", "utf-16-le", "cp1252"):
        assert decode_text("Größe 1\n".encode(encoding)) == "Größe 1\n"
