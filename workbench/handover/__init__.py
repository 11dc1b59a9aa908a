"""What leaves the house: gain tables with their proofs, code, reports."""
