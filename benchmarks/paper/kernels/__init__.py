"""Taichi kernels of the paper's own way to gradients."""
