"""Control laws of a single satellite, and the protocol that they implement.

Imports `dynamics` and below.
"""
