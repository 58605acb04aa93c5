"""Thrusters, sensors, filters and the noise that they draw. Imports `control` and below."""
