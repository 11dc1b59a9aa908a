"""Optimisation that knows no control: nonsmooth descent, its directions and memory, semidefinite programmes."""
