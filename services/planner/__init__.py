"""Planner: a collision-free path of the grips that brings the rope to its goal."""
