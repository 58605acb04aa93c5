"""Bags (MCAP): writing, reading, recovery, events. Imports no other room of this package."""
