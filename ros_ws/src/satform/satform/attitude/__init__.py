"""Attitude kinematics, gyrostat and wheels, pointing references and the tracking law.

Imports `control` and below.
"""
