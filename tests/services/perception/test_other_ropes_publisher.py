"""Other ropes are published while there are any, and their absence once a second."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from lariat.perception.other_ropes.other_ropes import SeenLine
from lariat.perception.rgbd.line_of_sight import Sight
from lariat.trajectory import SECOND
from services.perception.other_ropes_publisher import OthersPublisher
from shared.messages import OtherRopes

POINTS = np.stack([np.linspace(-0.1, 0.1, 40), np.zeros(40), np.full(40, 0.2)], axis=1)
LINE = SeenLine(POINTS, 0.005)


def hidden(points: np.ndarray) -> Sight:
    return Sight(np.zeros(len(points), bool), np.zeros(len(points), bool))


def said(lines: Sequence[SeenLine], count: int = 6) -> list[OtherRopes]:
    publisher, out = OthersPublisher(), []
    for k in range(count):
        now = SECOND + k * SECOND // 30
        out += [p.message for p in publisher.publications(lines, hidden, now, now)]
    return out


def test_a_rope_is_published_with_its_line_diameter_and_doubt() -> None:
    newest = said([LINE])[-1]
    (rope,) = newest.ropes
    assert (rope.id, rope.diameter) == (1, 0.005)
    assert 0.0 < rope.p_wrong < 0.02
    (line,) = rope.lines
    assert line.seen
    np.testing.assert_allclose(line.positions[-3:], POINTS[-1], atol=1e-9)


def test_a_cell_without_other_ropes_says_so_once_a_second() -> None:
    assert len(said([], count=65)) == 3


def test_a_short_line_is_doubted_more_than_a_long_one() -> None:
    short = SeenLine(POINTS[:10], 0.005)
    assert said([short])[-1].ropes[0].p_wrong > 10.0 * said([LINE])[-1].ropes[0].p_wrong
