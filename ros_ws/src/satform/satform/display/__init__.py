"""What a visualisation of a formation in flight shows. Imports `flight` and below."""
