"""How satellites move: orbital models and the accelerations that disturb them."""
