"""Launcher: starts, watches, restarts and ends the processes of a live stack."""
