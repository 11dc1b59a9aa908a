"""What is tuned: named parameters in named blocks, joined to a structure, closed around a model."""
