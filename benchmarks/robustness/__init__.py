"""Closed-loop runs with ropes, grips and simulators that the controller does not know."""
