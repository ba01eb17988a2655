"""Sizes of the memory of a chain's fit."""

BANDWIDTH = 12
"""Stored diagonals of the symmetric matrix, the main one included: four nodes of three."""
EDGE_COLUMNS = 8
"""Numbers that describe an edge: begin, direction, 1 / squared length, 1 / length."""
SUM_COLUMNS = 24
"""Numbers that the samples of an edge add up to: three symmetric blocks of the matrix, of six
numbers each, and two parts of the right-hand side."""
