"""From a scenario to the processes that fly it, and their life from start to end."""

PACKAGE = "satform_nodes"
"""Where the nodes' executables are."""
