from __future__ import annotations

from services.robot_gateway.drivers.cr5.link_quality import LinkQuality

TICK = 8_000_000


def test_rate_and_longest_gap_are_those_of_the_last_second() -> None:
    quality = LinkQuality()
    heard, now, count = None, 0, 0
    for k in range(500):
        now = k * TICK
        # Ten packets are missing in the second second, and none after that.
        if not 200 <= k < 210:
            heard, count = now, count + 1
        quality.update(heard, count, now)
        if k == 190:
            assert quality.rate(now) in (125.0, 126.0)
            assert abs(quality.gap(now) - 0.008) < 1e-9
        if k == 230:
            assert quality.rate(now) in (115.0, 116.0)
            assert abs(quality.gap(now) - 0.088) < 1e-9
    assert quality.rate(now) in (125.0, 126.0)
    assert abs(quality.gap(now) - 0.008) < 1e-9


def test_an_arm_that_falls_silent_shows_a_growing_gap() -> None:
    quality = LinkQuality()
    assert (quality.rate(0), quality.gap(0)) == (0.0, 0.0)
    quality.update(TICK, 1, TICK)
    for k in range(2, 300):
        quality.update(TICK, 1, k * TICK)
    assert quality.rate(299 * TICK) == 0.0
    assert abs(quality.gap(299 * TICK) - 298 * 0.008) < 1e-9


def test_packets_that_come_in_one_tick_count_each() -> None:
    quality = LinkQuality()
    for k in range(500):
        # Every third packet comes late, with the next one.
        late = k % 3 == 1
        quality.update((k - late) * TICK, k - late, k * TICK)
    assert quality.rate(499 * TICK) in (124.0, 125.0, 126.0)
    assert abs(quality.gap(499 * TICK) - 0.016) < 1e-9
