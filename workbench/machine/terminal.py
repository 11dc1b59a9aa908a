"""What leaves for a terminal or a pipe: text that cannot steer the terminal, streams whose reader may go away.

text from a file --printable--> escapes shown as escapes --outlive_readers--> stdout, stderr
"""

import io
import sys
import unicodedata

HIDDEN = frozenset({"Cc", "Cf", "Cs", "Zl", "Zp"})  # control, format (bidi overrides), lone surrogates, separators


def printable(text: str, keep: str = "") -> str:
    """The text with every character that a terminal would obey, or hide, written as an escape.

    keep : characters that may stay, such as a line's end

    Examples
    --------
    >>> print(printable("heave\\u001b[8m, \\u202ekcab, 0.5 µm"))
    heave\\x1b[8m, \\u202ekcab, 0.5 µm
    """
    if text.isprintable():
        return text
    return "".join(c if c in keep or unicodedata.category(c) not in HIDDEN else _escaped(c) for c in text)


def outlive_readers() -> None:
    """Makes stdout and stderr streams that take text for nothing once their reader has gone: `… | head` is no fault.

    What a command finds, and its exit code, do not depend on who still reads.
    """
    sys.stdout, sys.stderr = _patient(sys.stdout, 1), _patient(sys.stderr, 2)


class _Patient(io.FileIO):
    """The raw end of a stream, which keeps quiet when nobody reads any more, and says once that there is no room."""

    gone = False

    def write(self, data, /) -> int:
        if not self.gone:
            try:
                return super().write(data)
            except BrokenPipeError:
                self.gone = True
            except OSError as error:
                self.gone = True
                raise OSError(error.errno, error.strerror, "standard output") from error
        return memoryview(data).nbytes


def _patient(stream, descriptor: int) -> io.TextIOWrapper:
    if stream is None:  # closed by whoever started us
        return open("/dev/null", "w", encoding="utf-8")
    raw = _Patient(descriptor, "w", closefd=False)
    errors = "replace" if stream.errors == "strict" else stream.errors  # a letter that the terminal lacks is no fault
    return io.TextIOWrapper(
        io.BufferedWriter(raw), encoding=stream.encoding, errors=errors, line_buffering=stream.line_buffering
    )


def _escaped(character: str) -> str:
    code = ord(character)
    return f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"
