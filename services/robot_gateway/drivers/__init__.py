"""Arms, behind one interface: the cell says where the grip shall be, the driver says where it is.

To add another arm, write a class with the members of `Driver` beside these and name it in
`drivers/choose.py`. It is stepped at every tick with the time; it never blocks, reads no clock and
holds bytes to and from its device in a link.
"""

from services.robot_gateway.drivers.driver import Driver, Feedback

__all__ = ["Driver", "Feedback"]
