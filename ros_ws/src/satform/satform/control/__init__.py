"""Control laws of a single satellite."""
