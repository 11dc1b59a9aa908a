"""Reading what people write: data files of problems, checked key by key. The only room that knows pydantic."""
