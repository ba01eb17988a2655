"""Model predictive control: horizon, objective, constraints, collision avoidance, setpoints."""
