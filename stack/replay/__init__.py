"""Replay: a recorded service is stepped again through its recorded inputs, its outputs compared."""
