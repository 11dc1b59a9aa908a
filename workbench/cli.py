"""The command line: one function per command in `workbench.commands`, one place for errors, exit codes and JSON.

Exit code 0: done; 1: a requirement is not met or a check failed; 2: bad input, with one sentence on stderr.
Commands import what they need when they run, so that `workbench --help` stays quick.
"""

import sys

import typer

from workbench.commands import COMMANDS
from workbench.errors import InfeasibleError, InputError
from workbench.threads import keep_one_thread

app = typer.Typer(
    name="workbench",
    help="Control design for magnetically levitated vehicles.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
for command in COMMANDS:
    app.command()(command)


def main(arguments: list[str] | None = None) -> None:
    """Runs one command and leaves with its exit code."""
    keep_one_thread()  # nothing has loaded NumPy yet
    sys.exit(run(arguments))


def run(arguments: list[str] | None = None) -> int:
    """Runs one command and returns its exit code."""
    try:
        code = app(args=arguments, standalone_mode=False)
    except InputError as error:
        return _complain(str(error), 2)
    except InfeasibleError as error:
        return _complain(str(error), 1)
    except KeyboardInterrupt:
        return _complain("interrupted; what was finished is kept.", 130)
    except BrokenPipeError:
        return 0
    except OSError as error:  # a name too long, a full disk: whatever the system refuses and no command foresaw
        place = str(error.filename or "a file")[:120]
        return _complain(
            f"{place} must be usable; the system says: {error.strerror or error}. Check path and space.", 2
        )
    except Exception as error:  # typer's usage errors carry format_message; anything else is a defect and shows itself
        if type(error).__name__ == "Abort":
            return _complain("interrupted; what was finished is kept.", 130)
        if type(error).__name__ == "NoArgsIsHelpError":
            return 2
        message = getattr(error, "format_message", None)
        if message is None:
            raise
        return _complain(f"{message()} Try 'workbench --help'.", 2)
    return code if isinstance(code, int) else 0


def _complain(sentence: str, code: int) -> int:
    print(" ".join(sentence.split()), file=sys.stderr)  # noqa: T201
    return code
