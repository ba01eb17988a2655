"""Error of solvers against their processor time, for one motion: `lariat bench compare`.

A rope hangs between two clamps, one of which translates and turns about its axis for half a second
and then stands still for as long (`motion`). Solvers with several settings are compared with the
continuum (`continuum`).
"""
