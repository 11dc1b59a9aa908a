"""What signs a gain table: the SHA-256 of its canonical JSON, so that a changed digit is noticed.

document --sorted keys, no spaces, UTF-8, without `digest`--> text --SHA-256--> digest
"""

import hashlib
import json
from pathlib import Path
from typing import Any

from workbench.errors import InputError


def canonical(document: dict[str, Any]) -> str:
    """The one JSON text that the digest is taken of: keys sorted, no spaces, no digest, numbers as Python prints."""
    content = {key: value for key, value in document.items() if key != "digest"}
    return json.dumps(content, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False)


def digest_of(document: dict[str, Any]) -> str:
    """SHA-256 of a table's canonical JSON, in hexadecimal."""
    return hashlib.sha256(canonical(document).encode("utf-8", errors="surrogatepass")).hexdigest()


def check_digest(document: dict[str, Any], path: Path) -> None:
    """Refuses a table that was changed since it was signed."""
    try:
        expected = digest_of(document)
    except (ValueError, RecursionError) as error:  # an overflowing number such as 1e999, or nesting without end
        raise InputError(
            f"{path} must hold finite numbers, not deeply nested; it does not. Get the table again from its source."
        ) from error
    if document.get("digest") != expected:
        raise InputError(
            f"the digest of {path} must be the SHA-256 of its content; it says {str(document.get('digest'))[:12]!r}…, "
            f"the content gives {expected[:12]!r}…: the table was changed after it was signed. "
            "Get it again from its source."
        )
