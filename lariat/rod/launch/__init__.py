"""Launches of the kernel: layout of its arrays, inputs and outputs, kept machine code."""
