"""Launches of the paper's rod: layout of its arrays, inputs and outputs."""
