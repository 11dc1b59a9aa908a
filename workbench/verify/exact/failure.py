"""What the checker raises: one sentence each, for a file that is no table and for a promise it cannot prove."""


class TableError(ValueError):
    """A file that is not a usable gain table; says what must hold, what was given and what to do."""


class NotProved(RuntimeError):
    """Why a quantity has no proved enclosure; the promise that speaks of it is listed as not proved."""
