"""Types of real rclpy, run by the Python of an environment that has it.

    python rclpy_peer.py

Reads lines `TYPE HEX`, and prints for each the message as JSON, its own bytes, and a message made
without arguments, or null where it lacks the type.
"""

# pyright: reportMissingImports=none

from __future__ import annotations

import importlib
import json
import sys
from typing import Any

from rclpy.serialization import deserialize_message, serialize_message


def plain(value: Any) -> Any:
    """A message as lists and dictionaries."""
    if hasattr(value, "get_fields_and_field_types"):
        return {name: plain(getattr(value, name)) for name in value.get_fields_and_field_types()}
    if isinstance(value, str | bool | int | float):
        return value
    if isinstance(value, bytes):
        return list(value)
    return [plain(each) for each in value]


for line in sys.stdin:
    kind, payload = line.split()
    package, folder, name = kind.split("/")
    try:
        cls = getattr(importlib.import_module(f"{package}.{folder}"), name)
    except ImportError:
        print(json.dumps(None), flush=True)
        continue
    message = deserialize_message(bytes.fromhex(payload), cls)
    print(json.dumps([plain(message), serialize_message(message).hex(), plain(cls())]), flush=True)
