# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The documentation site: its build, its API pages and the hooks of Sphinx that `docs/conf.py` connects."""
