"""Looking into a running formation from outside, without disturbing it."""
