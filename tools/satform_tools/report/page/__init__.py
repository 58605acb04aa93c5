"""A report as one HTML page: content, charts, 3-D view and the template."""
