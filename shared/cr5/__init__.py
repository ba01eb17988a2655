"""The Dobot CR5 as its maker's TCP/IP protocol shows it; millimetres and degrees live here only."""
