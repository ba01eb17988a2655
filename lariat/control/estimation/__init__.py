"""Estimation: the state of the rope, and the adaptation of its material."""
