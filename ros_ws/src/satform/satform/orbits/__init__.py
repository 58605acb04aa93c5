"""Frames, chief orbit, relative orbits (curves) and motion along them, Earth and Sun.

Imports `common`, `numeric`, `files`.
"""
