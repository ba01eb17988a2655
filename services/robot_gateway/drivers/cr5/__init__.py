"""Driver of a Dobot CR5, over the vendor's TCP/IP protocol V3 or V4."""
