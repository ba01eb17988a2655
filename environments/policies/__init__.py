"""Policies of `environments.shape_control`, trained through the rod's gradients or from rewards."""
