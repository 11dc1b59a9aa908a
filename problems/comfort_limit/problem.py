"""Builds the problem that data.toml describes; change the record here where data alone cannot say it."""


def problem(data):
    """The design problem from the checked data."""
    return data.build()
