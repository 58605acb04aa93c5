# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Entry of `tools/satform`, run by path with an isolated Python."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from satform_setup.command import main

sys.exit(main(sys.argv[1:]))
