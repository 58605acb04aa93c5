"""Starts the command line; `tools/satform` runs this in the right environment."""

import sys

from satform_tools.cli import main

sys.exit(main())
