"""Parameter studies: many analyses or designs over sampled parameters, resumable, on processes or a cluster."""
