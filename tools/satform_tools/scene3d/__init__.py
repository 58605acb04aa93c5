# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""The 3-D scene of a formation in a browser, for reports and the live page, and the JavaScript libraries in it."""
