"""The flight itself: what it is checked for at each step, and how it may end early."""
