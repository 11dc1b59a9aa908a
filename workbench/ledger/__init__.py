"""The report's printed numbers and formulas beside ours, with a verdict on each."""
