"""Measurements of speed: functions that return rows and print nothing."""
