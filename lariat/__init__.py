"""Library of Lariat: differentiable rod, geometry and trajectories.

Import the packages: `lariat.rod`, `lariat.geometry`, `lariat.trajectory`.
"""
