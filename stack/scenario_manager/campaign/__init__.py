"""Campaigns: one scenario run headless for several seeds and settings, beside the live cell."""
