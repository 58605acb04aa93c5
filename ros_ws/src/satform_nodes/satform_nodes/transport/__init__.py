"""Topics and QoS, executor, CDR codec, validation of messages and publishers, discovery.

Imports no node.
"""
