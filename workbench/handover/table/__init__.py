"""Gain tables: a design as decimals, with promises that someone else can check."""
