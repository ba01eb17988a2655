"""Policies of `environments.shape_control`, and their training through the rod's gradients."""
