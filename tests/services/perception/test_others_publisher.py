"""Other ropes are learnt beside a chain that is surely the held rope."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from services.perception.centerline.estimate import CenterlineEstimate, OtherLine
from services.perception.others_publisher import OthersPublisher
from services.perception.rgbd.line_of_sight import Sight
from shared.messages import OtherRopes
from shared.service import SECOND

POINTS = np.stack([np.linspace(-0.1, 0.1, 40), np.zeros(40), np.full(40, 0.2)], axis=1)
SURE = CenterlineEstimate(
    np.zeros((5, 3)),
    np.zeros(5),
    np.ones(5, bool),
    others=(OtherLine(np.zeros((40, 2)), POINTS, 1.0),),
)


def hidden(points: np.ndarray) -> Sight:
    return Sight(np.zeros(len(points), bool), np.zeros(len(points), bool))


def said(estimate: CenterlineEstimate, count: int = 6) -> list[OtherRopes]:
    publisher, out = OthersPublisher(0.008), []
    for k in range(count):
        now = SECOND + k * SECOND // 30
        out += [p.message for p in publisher.publications(estimate, hidden, now, now)]
    return out


def test_a_rope_is_published_with_its_line_diameter_and_doubt() -> None:
    newest = said(SURE)[-1]
    (rope,) = newest.ropes
    assert (rope.id, rope.diameter) == (1, 0.008)
    assert 0.0 < rope.doubt < 0.02
    (line,) = rope.lines
    assert line.seen
    np.testing.assert_allclose(line.positions[-3:], POINTS[-1], atol=1e-9)


def test_nothing_is_learnt_beside_a_doubtful_chain() -> None:
    assert not any(message.ropes for message in said(replace(SURE, probability_wrong=0.2)))


def test_a_cell_without_other_ropes_says_so_once_a_second() -> None:
    assert len(said(replace(SURE, others=()), count=65)) == 3


def test_a_short_line_is_doubted_more_than_a_long_one() -> None:
    short = replace(SURE, others=(OtherLine(np.zeros((10, 2)), POINTS[:10], 1.0),))
    assert said(short)[-1].ropes[0].doubt > 10.0 * said(SURE)[-1].ropes[0].doubt
