"""Linear systems in exact rationals: poles, peaks, mean squares, dead times, each enclosed in balls."""
