"""Requirements, optimisers, the report's selection procedure, trade-offs, robustness."""
