"""Who takes part and over which communication graph, step by step; faults.

Imports `consensus` and below.
"""
