"""Layout of a recording: names and sizes that its writer and its reader share."""

from __future__ import annotations

CHUNK_SIZE = 256 * 1024
"""Uncompressed size at which a chunk is written [bytes]."""
SCENARIO_ATTACHMENT = "scenario.toml"
"""Name of the attachment with the scenario's text; its CSV files are attachments as well."""
METADATA_NAME = "lariat"
"""Name of the metadata record with the scenario's name and the versions."""
