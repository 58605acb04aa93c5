"""Parts that every room uses: base class of specifications, wording, exit codes, angles as text.

Imports no other room.
"""
