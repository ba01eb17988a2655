"""Supervision of a run: when to hold, stop for another path, give up, and what is reached."""
