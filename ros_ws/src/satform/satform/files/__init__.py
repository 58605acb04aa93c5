"""Files from anywhere, read within bounds and written whole or not at all. Imports `common` only."""
