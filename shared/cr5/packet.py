"""The feedback packet of ports 30004 to 30006: 1440 bytes, little-endian, no padding.

Offsets are those of the maker's document for V3 (2024-01) and V4 (4.6.5); fields that only one of
them has keep their offset, the other sends zeros there.
"""

from __future__ import annotations

import numpy as np

SIZE = 1440
TEST_VALUE = 0x0123456789ABCDEF
TEST_OFFSET = 48
TEST_BYTES = TEST_VALUE.to_bytes(8, "little")

_FIELDS: tuple[tuple[str, int, str, int], ...] = (
    ("message_size", 0, "<u2", 1),
    ("digital_inputs", 8, "<u8", 1),
    ("digital_outputs", 16, "<u8", 1),
    ("robot_mode", 24, "<u8", 1),
    ("time_stamp", 32, "<u8", 1),
    ("run_time", 40, "<u8", 1),
    ("test_value", TEST_OFFSET, "<u8", 1),
    ("speed_scaling", 64, "<f8", 1),
    ("main_voltage", 80, "<f8", 1),
    ("robot_voltage", 88, "<f8", 1),
    ("robot_current", 96, "<f8", 1),
    ("elbow_position", 144, "<f8", 3),
    ("q_target", 192, "<f8", 6),
    ("qd_target", 240, "<f8", 6),
    ("qdd_target", 288, "<f8", 6),
    ("q_actual", 432, "<f8", 6),
    ("qd_actual", 480, "<f8", 6),
    ("i_actual", 528, "<f8", 6),
    ("tool_vector_actual", 624, "<f8", 6),
    ("tcp_speed_actual", 672, "<f8", 6),
    ("tcp_force", 720, "<f8", 6),
    ("tool_vector_target", 768, "<f8", 6),
    ("tcp_speed_target", 816, "<f8", 6),
    ("motor_temperatures", 864, "<f8", 6),
    ("joint_modes", 912, "<f8", 6),
    ("joint_voltages", 960, "<f8", 6),
    ("hand_type", 1008, "i1", 4),
    ("user", 1012, "i1", 1),
    ("tool", 1013, "i1", 1),
    ("queue_running", 1014, "i1", 1),
    ("queue_paused", 1015, "i1", 1),
    ("velocity_ratio", 1016, "i1", 1),
    ("acceleration_ratio", 1017, "i1", 1),
    ("xyz_velocity_ratio", 1019, "i1", 1),
    ("r_velocity_ratio", 1020, "i1", 1),
    ("xyz_acceleration_ratio", 1021, "i1", 1),
    ("r_acceleration_ratio", 1022, "i1", 1),
    ("brake_status", 1025, "i1", 1),
    ("enable_status", 1026, "i1", 1),
    ("drag_status", 1027, "i1", 1),
    ("running_status", 1028, "i1", 1),
    ("error_status", 1029, "i1", 1),
    ("jog_status", 1030, "i1", 1),
    ("robot_type", 1031, "u1", 1),
    ("collision_state", 1038, "i1", 1),
    ("current_command_id", 1112, "<u8", 1),
    ("load", 1168, "<f8", 1),
    ("load_center", 1176, "<f8", 3),
    ("user_frame", 1200, "<f8", 6),
    ("tool_frame", 1248, "<f8", 6),
    ("target_quaternion", 1352, "<f8", 4),
    ("actual_quaternion", 1384, "<f8", 4),
    ("safety_state", 1420, "u1", 1),
)

LAYOUT = np.dtype(
    {
        "names": [name for name, *_ in _FIELDS],
        "formats": [kind if count == 1 else (kind, (count,)) for _, _, kind, count in _FIELDS],
        "offsets": [offset for _, offset, *_ in _FIELDS],
        "itemsize": SIZE,
    }
)


def blank() -> np.ndarray:
    """A record of zeros with its size and test value set; `tobytes` is the packet."""
    record = np.zeros((), dtype=LAYOUT)
    record["message_size"], record["test_value"] = SIZE, TEST_VALUE
    return record


MOST = {
    "q_actual": 400.0,
    "tool_vector_actual": 3000.0,
    "tcp_speed_actual": 10000.0,
    "tcp_force": 10000.0,
}
"""What no arm of this kind ever tells of itself [deg, mm, mm/s and deg/s, N]."""


def credible(record: np.ndarray) -> bool:
    """Whether what a gateway moves by can be: joints, pose, speed and force; NaN cannot."""
    return all(bool(np.all(np.abs(record[name]) <= most)) for name, most in MOST.items())


class PacketReader:
    """Finds packets in a stream of bytes that may begin, tear or repeat anywhere."""

    def __init__(self) -> None:
        self._buffer = bytearray()
        self.skipped = 0
        """Bytes thrown away to find a packet's start."""

    def feed(self, data: bytes) -> np.ndarray | None:
        """The newest whole packet that the bytes complete, or None."""
        self._buffer += data
        newest = None
        while len(self._buffer) >= SIZE:
            if self._aligned():
                newest = bytes(self._buffer[:SIZE])
                del self._buffer[:SIZE]
            else:
                self._resynchronise()
        return None if newest is None else np.frombuffer(newest, dtype=LAYOUT)[0]

    def _aligned(self) -> bool:
        size = int.from_bytes(self._buffer[:2], "little")
        return size == SIZE and self._buffer[TEST_OFFSET : TEST_OFFSET + 8] == TEST_BYTES

    def _resynchronise(self) -> None:
        hit = self._buffer.find(TEST_BYTES, TEST_OFFSET + 1)
        # Without a hit the last bytes may still be the beginning of one.
        drop = hit - TEST_OFFSET if hit >= 0 else len(self._buffer) - TEST_OFFSET - 7
        self.skipped += drop
        del self._buffer[:drop]
