"""The rod against the continuum and closed-form solutions."""
