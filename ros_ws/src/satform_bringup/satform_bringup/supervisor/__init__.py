"""A flight's processes from start to end: process server, supervisor, run registry, rejoin."""
