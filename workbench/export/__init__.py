"""Gain tables and problem files in and out; reports."""
