"""Ropes in a single colour image of an unknown camera."""
