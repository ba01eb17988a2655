"""Taichi kernels of the paper's method to compute gradients."""
