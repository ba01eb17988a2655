"""Agreements between processes: messages, topics, bus, service contract, scenario, recording."""
