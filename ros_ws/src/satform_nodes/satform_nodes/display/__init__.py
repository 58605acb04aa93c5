"""The node that publishes markers, poses, paths and transforms for RViz and Foxglove."""
