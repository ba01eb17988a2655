"""Bandwidth of the normal equations of a chain's fit."""

BANDWIDTH = 12
"""Stored diagonals of the symmetric matrix, the main one included: four nodes of three."""
