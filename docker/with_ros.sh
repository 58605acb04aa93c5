#!/bin/bash
# Run the arguments in an environment with ROS 2 sourced.
source /opt/ros/jazzy/setup.bash
exec "$@"
