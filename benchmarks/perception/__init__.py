"""Accuracy of the perceived rope in single images."""
