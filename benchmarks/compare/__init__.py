"""Error of solvers against their processor time, for one motion: the diagram of `lariat bench rod`.

A rope hangs between two clamps, one of which translates and turns about its axis for half a second
and then stands still for as long (`motion`). Solvers with several settings (`contenders`) are
compared with the continuum (`continuum`), all in one process on one core (`measurement`), and drawn
(`picture`). `growth` measures how their time grows with nodes, obstacles and ropes.
"""
