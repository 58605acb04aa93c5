"""The node of the plant: publishers, subscriptions, services and the node itself."""
