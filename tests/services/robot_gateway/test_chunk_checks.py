"""Chunks of a cell with a CR5: the newest one of a tick that keeps every rule is followed."""

from __future__ import annotations

import numpy as np
import pytest

from lariat.geometry.obstacles import TABLE, Obstacle
from lariat.trajectory import SetpointChunk
from services.robot_gateway.writer_control import WriterChunk
from tests.services.robot_gateway.arm_cell import ArmWorld
from tests.services.robot_gateway.cells import ALONG_X, smooth_step, stopping


@pytest.fixture
def world() -> ArmWorld:
    made = ArmWorld()
    made.until_ready()
    return made


def chunk(world: ArmWorld, way: tuple[float, float, float], sequence: int) -> WriterChunk:
    """A chunk that leads the grip this way [m] in 0.5 s."""
    here = world.cell.follower.state.positions
    times = 0.02 * np.arange(28)
    points = stopping(np.array([here + smooth_step(t, 0.5) * np.array(way) for t in times]))
    turns = np.tile(ALONG_X, (len(points), 1, 1))
    return WriterChunk(SetpointChunk(world.now, 0.02, points, turns), "writer", sequence, world.now)


UP, ASIDE, FAST = (0.0, 0.0, 0.02), (0.0, 0.04, 0.0), (0.0, 0.0, 2.0)


def test_chunk_is_followed_in_the_tick_in_which_it_arrives(world: ArmWorld) -> None:
    world.cell.take_chunks([chunk(world, UP, 7)])
    world.step()
    assert (world.report.sequence, world.mode) == (7, "moving")
    world.run(0.03)
    assert not world.cell.follower.resting


def test_writer_of_a_chunk_in_every_tick_is_followed_in_every_one(world: ArmWorld) -> None:
    accepted = []
    for k in range(1, 41):
        world.cell.take_chunks([chunk(world, UP, k)])
        world.step()
        accepted.append(world.report.sequence)
    assert accepted == list(range(1, 41))
    assert world.mode == "moving"


@pytest.mark.parametrize("stop", ["hold", "disarm", "writer", "stalled", "left_behind"])
def test_stop_voids_a_chunk_of_the_same_tick(world: ArmWorld, stop: str) -> None:
    world.cell.take_chunks([chunk(world, UP, 1)])
    world.step()
    assert world.mode == "moving"
    world.cell.take_chunks([chunk(world, ASIDE, 2)])
    match stop:
        case "writer":
            world.cell.take_hold("writer", 3, world.now, "")
        case "stalled":
            world.now += 200_000_000
        case "left_behind":
            # The next chunk may move the arms again, but not one of before the stop.
            world.cell._control.stop("left_behind", "for a test")
        case _:
            world.command(stop)
    world.run(2.0)
    assert world.report.sequence != 2
    assert world.cell.follower.resting
    if stop == "hold":
        # What waited is void after a person goes on, too.
        before = world.cell.follower.state.positions
        world.go_on()
        world.run(0.5)
        assert world.report.sequence == 1
        np.testing.assert_allclose(world.cell.follower.state.positions, before, atol=1e-3)


def test_obstacle_that_appears_after_the_chunk_in_its_tick_counts(world: ArmWorld) -> None:
    grip = world.cell.follower.state.positions[0]
    world.cell.take_chunks([chunk(world, ASIDE, 1)])
    place = (grip[0], grip[1] + 0.05, grip[2])
    world.cell.take_scene([TABLE, Obstacle("sphere", place, radius=0.01, name="post")])
    world.step()
    assert (world.report.sequence, world.report.refused_sequence) == (0, 1)
    assert world.report.rule == "keep_out"
    assert world.cell.follower.resting


def test_scene_that_changes_in_every_tick_delays_no_chunk(world: ArmWorld) -> None:
    for k in range(1, 21):
        far = Obstacle("sphere", (2.0, 0.01 * k, 1.0), radius=0.05, name="far")
        world.cell.take_scene([TABLE, far])
        world.cell.take_chunks([chunk(world, UP, k)])
        world.step()
    assert (world.report.sequence, world.mode) == (20, "moving")


def test_obstacle_between_the_grips_counts_before_the_way_round_it_is_known(
    world: ArmWorld,
) -> None:
    """The rope would be taut round it, however far it is from gripper and arm."""
    first, second = (end.position for end in world.cell.arms.grips)
    middle = 0.5 * (first + second)
    wall = Obstacle("box", tuple(middle.tolist()), size=(0.02, 3.0, 3.0), name="wall")
    world.cell.take_scene([TABLE, wall])
    world.cell.take_chunks([chunk(world, UP, 1)])
    world.step()
    assert world.report.sequence == 0
    assert (world.report.refused_sequence, world.report.rule) == (1, "overstretch")
    assert "no path of the permitted length" in world.report.refusal


def follow_to_the_end(world: ArmWorld, last: int | None) -> int:
    """Follow one chunk to its end, beside refused ones that keep the writer alive.

    Args:
        world: The cell.
        last: Ticks until another chunk, number 2, is sent; None: there is none.

    Returns:
        Number of ticks until the chunk has ended.
    """
    world.cell.take_chunks([chunk(world, UP, 1)])
    world.run(0.008)
    for tick in range(1, 400):
        message = chunk(world, UP, 2) if tick == last else chunk(world, FAST, 40)
        world.cell.take_chunks([message])
        world.step()
        if not world.cell.follower.following:
            return tick
    raise AssertionError("the chunk does not end")


def test_chunk_that_arrives_as_the_one_before_ends_is_followed(world: ArmWorld) -> None:
    end = follow_to_the_end(world, last=None)
    other = ArmWorld()
    other.until_ready()
    assert follow_to_the_end(other, last=end) == 2 * end
    assert other.report.sequence == 2


def test_refused_chunks_in_every_tick_do_not_hide_those_of_the_writer(world: ArmWorld) -> None:
    accepted = set()
    for k in range(1, 61):
        forged = chunk(world, FAST, k + 40)
        good = [chunk(world, UP, k)] if k % 3 == 0 else []
        world.cell.take_chunks([forged, *good])
        world.step()
        accepted.add(world.report.sequence)
    assert len(accepted) >= 12, accepted


def test_chunk_that_is_delivered_twice_is_followed_once(
    world: ArmWorld, monkeypatch: pytest.MonkeyPatch
) -> None:
    follower, followed = world.cell.follower, []
    follow = follower.follow
    monkeypatch.setattr(follower, "follow", lambda *args: followed.append(args) or follow(*args))
    sent = chunk(world, UP, 1)
    for _ in range(6):
        world.cell.take_chunks([sent])
        world.step()
    assert len(followed) == world.report.sequence == 1
    assert "sequence 1 after 1" in world.report.refusal


def test_silence_counts_from_the_receipt_of_the_last_chunk(world: ArmWorld) -> None:
    braking = []
    world.cell.take_chunks([chunk(world, UP, 1)])
    for _ in range(10):
        braking.append(world.step().braking)
    # 50 ms, of which the last period counts in advance: at the sixth tick.
    assert braking.index(True) == 5, braking
