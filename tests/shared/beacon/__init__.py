"""A small real service for tests of what runs services: it answers requests in its state."""
