"""Training of the network that finds ropes in single pictures (`lariat see`)."""
