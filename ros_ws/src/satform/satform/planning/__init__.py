"""Impulsive transfers, transfer plans and patrol plans, and the guidance that flies them.

Imports `control` and below.
"""
