"""Latency from exposure to accepted setpoints, from a recording."""

from __future__ import annotations

from pathlib import Path

from benchmarks.speed.live import COLOR, DEPTH, STAGES, latencies
from lariat.scenario import load
from lariat.trajectory import SECOND
from shared import topics
from shared.messages import ArmStates, NodeChain, Setpoints, timestamp
from shared.recording import Recording, Writer

SCENARIO = load("three-cylinders")
MS = SECOND // 1000


def test_one_image_is_followed_through_every_process(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    writer = Writer(path, SCENARIO, SECOND)
    sent: list[tuple] = []
    for k in range(4):
        exposed = SECOND + 100 * k * MS
        frame = {"timestamp": timestamp(exposed)}
        sent += [
            (COLOR, COLOR.type(**frame), exposed + 4 * MS),
            (DEPTH, DEPTH.type(**frame), exposed + 5 * MS),
            (topics.ROPE_NODES, NodeChain(stamp=exposed), exposed + 15 * MS),
            # A later step on the same image does not count.
            *(
                (
                    topics.ARM_SETPOINTS,
                    Setpoints(session="c", sequence=2 * k + again, image_stamp=exposed),
                    exposed + (25 + 20 * again) * MS,
                )
                for again in (0, 1)
            ),
            (topics.ARM_STATE, ArmStates(session="other", sequence=99), exposed + 26 * MS),
        ]
        if k < 3:
            # The last chunk is never accepted.
            state = ArmStates(session="c", sequence=2 * k)
            sent.append((topics.ARM_STATE, state, exposed + (30 + k) * MS))
    for k, (topic, message, at) in enumerate(sent):
        writer.write(topic, message.SerializeToString(), "x-0", k, at + MS, at)
    writer.close()
    found = latencies([Recording.open(path)])
    figures = [(row["stage"], row["images"], row["p50_ms"], row["p99_ms"]) for row in found]
    assert [row["stage"] for row in found] == list(STAGES)
    assert figures[:3] == [
        ("image published", 4, 5.0, 5.0),
        ("rope published", 4, 15.0, 15.0),
        ("setpoints published", 4, 25.0, 25.0),
    ]
    assert figures[3][1:3] == (3, 31.0)
    assert 31.9 < figures[3][3] <= 32.0
