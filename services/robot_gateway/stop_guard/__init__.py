"""Guard of an arm: a process that stops it when the gateway has died or hangs."""
