"""Kernel of the paper's rod: Algorithm 1, and its adjoint along a tape.

Files, in reading order:

    rollout           the kernel
    step              prediction, sweeps, velocities
    constraints       corrections of stretch, bend and contact, and their adjoints
    collision         entries of nodes into obstacles
    adjoint           the step backwards
    quaternions       products of quaternions
    addressing        offsets in the two arrays
"""
