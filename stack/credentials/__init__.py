"""Credentials of the bus: who may join it, and who may publish what."""
