"""Inspecting a running formation from outside, without disturbing it."""
