"""Bench of the gateway's tick: chunks are followed, and refused where they break a rule."""

from __future__ import annotations

from benchmarks.faults.chunks import CHUNKS, GatewayCell
from lariat.scenario import load
from shared.messages import ArmStates


def test_longest_chunk_is_followed_beside_one_that_is_refused() -> None:
    cell = GatewayCell(load("three-cylinders"), 0)
    for count, dt, _ in CHUNKS.values():
        good, bad = cell.chunk(count, dt), cell.chunk(count, dt, refused=True)
        cell.step([good, bad])
        # The newest one is refused; the one before it is checked at the next tick.
        state, seconds = cell.step([])
        assert (state.sequence, state.refused_sequence) == (good.sequence, bad.sequence)
        assert state.mode == ArmStates.MOVING
        assert seconds > 0.0
