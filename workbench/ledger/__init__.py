"""Every number the report prints beside ours, with a verdict."""
