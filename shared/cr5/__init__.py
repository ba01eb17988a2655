"""Dobot CR5: feedback packet, operating modes and alarms, pose vectors, kinematics, installation.

Shared by the gateway's driver and the emulator. Only the protocol uses millimetres and degrees.
"""
