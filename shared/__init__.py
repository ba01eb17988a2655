"""What two processes must agree on: messages, topics, the service contract, geometry, the rod."""
