"""The programs that a user could take instead, one per file, each on the identical problem."""
