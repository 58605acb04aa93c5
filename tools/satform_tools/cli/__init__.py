"""The commands and their options; what they do is in the other rooms."""
