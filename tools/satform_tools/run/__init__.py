"""Flying a scenario, storing the run, replaying and recovering it."""
