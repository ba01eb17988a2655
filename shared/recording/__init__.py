"""Recordings: MCAP files that hold all messages of a cell and its scenario.

A file holds one channel for each topic and publisher, the protobuf descriptors of all messages (so
that Foxglove, Rerun and other readers of MCAP open it), the scenario with its CSV files, and the
version of Lariat. Messages are ordered by log time, which is the time of their receipt. Everything
up to the last flush can be read even if the writer is killed.
"""

from shared.recording.reader import Entry, Recording
from shared.recording.repair import copy_readable
from shared.recording.writer import Writer

__all__ = ["Entry", "Recording", "Writer", "copy_readable"]
