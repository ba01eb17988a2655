"""Requests for scenarios: checked, saved, and started in place of the one that runs."""
