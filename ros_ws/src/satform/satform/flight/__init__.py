"""The flight: plant, flight software of a satellite, in-process simulation, record, checkpoints.

Imports `scenario` and below.
"""
