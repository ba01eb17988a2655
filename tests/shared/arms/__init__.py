"""Arms of any make."""
