"""Ropes as instances in single pictures: judgement, calibration of doubt, tables."""
