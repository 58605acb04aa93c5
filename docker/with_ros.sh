#!/bin/bash
# Runs its arguments with ROS 2 sourced.
source /opt/ros/jazzy/setup.bash
exec "$@"
