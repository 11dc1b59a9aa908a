"""Designs whose controller is affine in its parameters: limits of gains at every frequency, least integrated error."""
