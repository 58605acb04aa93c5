"""Figures of a flight by subject, and the expectations that judge it. Imports `flight` and below."""
