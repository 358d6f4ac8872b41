"""What users would take otherwise, one way to a file, each on the identical problem."""
