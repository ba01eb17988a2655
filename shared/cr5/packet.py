"""Feedback packet of ports 30004 to 30006: 1440 bytes, little-endian, no padding.

Offsets are those of the vendor's documents for V3 (2024-01) and V4 (4.6.5); a field that only one
version has is zero in the other.
"""

from __future__ import annotations

import numpy as np

PACKET_SIZE = 1440
"""Size of a packet [bytes]."""
TEST_VALUE = 0x0123456789ABCDEF
"""Constant in every packet, by which its start is found."""
TEST_OFFSET = 48
"""Offset of the test value in a packet [bytes]."""
TEST_BYTES = TEST_VALUE.to_bytes(8, "little")
"""The test value as sent."""

PLAUSIBLE_LIMITS = {
    "q_actual": 400.0,
    "tool_vector_actual": 3000.0,
    "tcp_speed_actual": 10000.0,
    "tcp_force": 10000.0,
}
"""Magnitudes above which a value is impossible [deg, mm, mm/s and deg/s, N]."""

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
"""Name, offset [bytes], type and length of each field."""

PACKET_DTYPE = np.dtype(
    {
        "names": [name for name, *_ in _FIELDS],
        "formats": [kind if count == 1 else (kind, (count,)) for _, _, kind, count in _FIELDS],
        "offsets": [offset for _, offset, *_ in _FIELDS],
        "itemsize": PACKET_SIZE,
    }
)
"""Structured type of a packet."""


def blank() -> np.ndarray:
    """Return a record of zeros with size and test value; its `tobytes` is the packet."""
    record = np.zeros((), dtype=PACKET_DTYPE)
    record["message_size"], record["test_value"] = PACKET_SIZE, TEST_VALUE
    return record


def is_plausible(record: np.ndarray) -> bool:
    """Whether joints, pose, speed and force have possible values; NaN is impossible."""
    for name, limit in PLAUSIBLE_LIMITS.items():
        # Comparisons with NaN are false. For six numbers, NumPy takes several times as long.
        if not all(-limit <= value <= limit for value in record[name].tolist()):
            return False
    return True


class PacketReader:
    """Reader of packets from a stream of bytes that may start, be torn or be corrupted anywhere."""

    def __init__(self) -> None:
        self._buffer = bytearray()
        self.count = 0
        """Packets so far."""
        self.skipped = 0
        """Bytes skipped to find the start of a packet."""

    def feed(self, data: bytes) -> np.ndarray | None:
        """Return the newest packet that the bytes complete; None when there is none."""
        self._buffer += data
        newest = None
        while len(self._buffer) >= PACKET_SIZE:
            if self._aligned():
                newest = bytes(self._buffer[:PACKET_SIZE])
                del self._buffer[:PACKET_SIZE]
                self.count += 1
            else:
                self._resynchronize()
        return None if newest is None else np.frombuffer(newest, dtype=PACKET_DTYPE)[0]

    def _aligned(self) -> bool:
        size = int.from_bytes(self._buffer[:2], "little")
        return size == PACKET_SIZE and self._buffer[TEST_OFFSET : TEST_OFFSET + 8] == TEST_BYTES

    def _resynchronize(self) -> None:
        hit = self._buffer.find(TEST_BYTES, TEST_OFFSET + 1)
        # Without a hit, the last bytes may still be the start of a test value.
        drop = hit - TEST_OFFSET if hit >= 0 else len(self._buffer) - TEST_OFFSET - 7
        self.skipped += drop
        del self._buffer[:drop]
