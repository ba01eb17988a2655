"""Editors of the goal and of the obstacles."""
