"""Commissioning of a cell."""
