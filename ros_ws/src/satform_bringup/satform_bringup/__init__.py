"""From a scenario to the processes that fly it, and their life from start to end."""
