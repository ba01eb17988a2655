"""Command line `lariat`: a module for each verb."""
