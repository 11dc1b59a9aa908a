"""The loop of a gain table of any plant, built again in exact rationals: models, blocks by kind, channels."""
