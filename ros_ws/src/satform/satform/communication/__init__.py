"""Messages between satellites, their topics, and the channel model that loses and delays them.

Imports `membership` and below.
"""
