"""The rows of the benchmark, by name: each a function of `quick` that measures and returns its result."""
