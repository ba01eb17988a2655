"""Taichi kernels of the simulated camera."""
