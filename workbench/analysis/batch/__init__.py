"""Many closed loops of one group of motion at a time: what studies and screenings evaluate."""
