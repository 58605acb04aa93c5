"""Truth dynamics models of relative motion: CW, perturbed CW, J2, inertial; forces and integrators.

Imports `orbits` and below.
"""
