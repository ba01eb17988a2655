"""Faults injected into the whole stack and its parts."""
