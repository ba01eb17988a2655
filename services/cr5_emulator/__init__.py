"""Emulator of a Dobot CR5: the vendor's TCP/IP protocol, byte for byte, and the arm's motion."""
