"""Who may say and hear what in a formation, as the policies, permissions and keys of SROS 2."""
