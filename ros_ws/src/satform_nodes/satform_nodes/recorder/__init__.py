"""The node that records every message of a flight into a bag."""
