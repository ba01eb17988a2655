"""Constraints on where grippers and arms may be: workspace, collision, spacing, rope, joints."""
