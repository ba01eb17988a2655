"""Closed-loop runs to random goals in random scenes."""
