"""Runs that the recorder knows: their results, curves, notes and files."""
