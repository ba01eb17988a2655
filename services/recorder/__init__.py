"""Recorder: every message of the bus to MCAP files, and a drawing of the cell for viewers."""
