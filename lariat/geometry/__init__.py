"""Poses, obstacles, polylines and cameras in plain numpy; knows no bus, file or clock."""
