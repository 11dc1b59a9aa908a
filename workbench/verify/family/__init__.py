"""Claims over a whole box of parameters: polynomials in Bernstein form, zero exclusion, Lyapunov matrices."""
