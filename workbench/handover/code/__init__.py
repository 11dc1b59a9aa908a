"""The law of a gain table where it will run: C, MATLAB, CSV; sampled as it is implemented."""
