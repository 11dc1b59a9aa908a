"""The twin of the vehicle: law, loops, physics and promises of its tables, derived a second time."""
