"""Perception of ropes: node chains from RGB-D frames, ropes in pictures, obstacles by markers."""
