"""Checks of each kind of message, whose lengths must fit each other."""
