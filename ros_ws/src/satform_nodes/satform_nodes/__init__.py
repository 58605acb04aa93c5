"""The formation's ROS 2 nodes: thin shells that convert, wait and publish around `satform`."""
