"""The paper's experiments with a real rope and cable, with MuJoCo in place of the lab."""
