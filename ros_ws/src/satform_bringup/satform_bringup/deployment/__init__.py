"""Where and how processes meet: DDS domain, discovery, several hosts, security, preflight checks."""
