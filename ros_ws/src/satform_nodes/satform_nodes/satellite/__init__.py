"""The node of one satellite, the group of several in one process, and what both publish and subscribe."""
