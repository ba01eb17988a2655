"""A CR5 that is not there: its maker's protocol, byte for byte, and an arm that moves behind it."""
