"""What a coil set feels: levitation force laws, exact and expanded, and the linear synchronous motor."""
