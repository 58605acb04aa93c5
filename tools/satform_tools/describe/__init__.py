"""Descriptions of a scenario before it flies, and of everything that a scenario may contain."""
