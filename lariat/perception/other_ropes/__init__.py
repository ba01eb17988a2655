"""Ropes and other thin things beside the held rope."""
