"""What a flight is judged by, and what came of it."""
