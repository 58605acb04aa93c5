"""The record of a flight as plain arrays, in process or from a bag. Imports `equipment` and below."""
