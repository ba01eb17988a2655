"""Dobot CR5: packet layout, alarms, units, kinematics and place in a cell.

Shared by the gateway's driver and the emulator. Only the protocol uses millimetres and degrees.
"""
