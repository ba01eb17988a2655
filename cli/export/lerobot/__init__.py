"""Recordings as a LeRobot data set: a local folder, an episode for each recording.

An episode lasts from the start of a run to its end. Its frames lie evenly in time and hold what had
been published by then.
"""
