"""Tab of campaigns: a scenario run headless for several seeds and settings."""
