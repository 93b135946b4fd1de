"""The page of the benchmark: duocell, the source's procedure and general methods on the same tasks."""
