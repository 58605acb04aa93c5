# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""A report as one HTML page: content, charts, 3-D view and the template."""
