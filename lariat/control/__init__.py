"""Control of a rope: state estimation, model predictive control, runs and their supervision."""
