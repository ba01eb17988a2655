"""The paper's experiments with a real rope and cable, with MuJoCo in the place of the lab."""
