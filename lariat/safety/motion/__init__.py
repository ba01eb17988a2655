"""Commanded motion: validation of setpoints, following them, stopping, approaching the start."""
