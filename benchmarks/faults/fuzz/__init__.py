"""Hostile messages and files for every process, drawn by hypothesis."""
