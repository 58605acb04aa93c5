"""Life of a node process: start, parameters, flight loops, signals, diagnostics.

Imports `transport` and `bag`, no node.
"""
