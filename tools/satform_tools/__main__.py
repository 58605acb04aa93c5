"""Starts the command line; `tools/satform` runs this in the right environment."""

import sys

try:
    from satform_tools.cli import main

    sys.exit(main())
except KeyboardInterrupt:
    # Before a command has its own way to end.
    sys.exit(130)
