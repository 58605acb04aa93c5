"""Plots of a flight with matplotlib."""
