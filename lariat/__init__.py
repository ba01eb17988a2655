"""Library of Lariat: everything that computes, without bus, process or clock.

Import the packages, e.g. `lariat.rod`, `lariat.perception`, `lariat.planning`, `lariat.control`.
"""
