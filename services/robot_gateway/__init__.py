"""The gateway to the arms of a cell: safety, constraints, commanded motion and drivers."""
