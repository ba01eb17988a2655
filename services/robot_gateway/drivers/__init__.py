"""Arm drivers behind one protocol: commanded grip pose in, measured grip pose out.

To add an arm, write a class with the members of `Driver` beside these and create it in
`drivers/factory.py`. It is stepped at every tick of the gateway with the time; it never blocks and
reads no clock.
"""

from services.robot_gateway.drivers.driver import ArmFeedback, Driver

__all__ = ["ArmFeedback", "Driver"]
