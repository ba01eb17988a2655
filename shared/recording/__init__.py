"""Recordings: MCAP files that hold all messages of a cell and its scenario.

A file holds one channel for each topic and publisher, the protobuf descriptors of all messages (so
that Foxglove, Rerun and other readers of MCAP open it), the scenario with its CSV files, and the
version of Lariat. Log times are times of receipt; messages are stored in their order, but at the
begin of a run's file states before the images of its pre-roll. Everything up to the last flush can
be read even if the writer is killed.
"""

from shared.recording.reader import Entry, Recording
from shared.recording.repair import copy_readable
from shared.recording.writer import Writer

__all__ = ["Entry", "Recording", "Writer", "copy_readable"]
