"""Communication graphs and consensus laws on the generalised arc length. Imports `control` and below."""
