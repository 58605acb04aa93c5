#!/bin/bash
# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
# Run the arguments in an environment with ROS 2 sourced.
source /opt/ros/jazzy/setup.bash
exec "$@"
