"""Gradients, speed, robustness and accuracy of the rod."""
