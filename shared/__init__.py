"""What processes agree on: messages, topics, bus, service contract, scenario, recording, CR5 facts."""
