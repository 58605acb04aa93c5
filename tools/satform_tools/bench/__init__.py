"""Measurements of speed: functions that return rows, and their printing."""
