"""The command line: runs, reports and checks of satellite formations."""
