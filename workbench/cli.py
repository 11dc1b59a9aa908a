"""The command line: one place for signals, errors and exit codes; the commands are in `workbench.commands`.

    0 done | 1 a requirement or promise is not met | 2 bad input | 3 a defect of ours | 130 SIGINT | 143 SIGTERM

Each but the first says one sentence on stderr. Little is imported before the signals are watched; commands import
what they need when they run, so that `workbench --help` stays quick.
"""

import sys

from workbench.machine import interrupts


def main(arguments: list[str] | None = None) -> None:
    """Runs one command in a process of its own and leaves with its exit code."""
    interrupts.watch()

    import warnings

    from workbench.machine import supervision
    from workbench.machine.terminal import outlive_readers
    from workbench.machine.threads import keep_one_thread

    if not sys.warnoptions:
        warnings.simplefilter("ignore")  # of libraries; a command says what it has to say itself
    keep_one_thread()  # nothing has loaded NumPy yet
    outlive_readers()
    supervision.permit()
    supervision.leave(run(arguments))


def run(arguments: list[str] | None = None) -> int:
    """Runs one command and returns its exit code."""
    try:
        from workbench.commands.app import invoke

        interrupts.working(True)
        code = invoke(arguments)
        sys.stdout.flush()
        interrupts.working(False)
    except BaseException as error:
        interrupts.working(False)
        code = _explained(error)
    ended_by = interrupts.received()
    return 128 + ended_by if ended_by else code


def _explained(error: BaseException) -> int:
    """The exit code of what a command raised, after one sentence on stderr."""
    from workbench.commands.app import as_usage
    from workbench.errors import InfeasibleError, InputError
    from workbench.machine.supervision import LATE, Late

    if isinstance(error, KeyboardInterrupt) or interrupts.received():  # a library may have made something else of it
        return _complain(f"{interrupts.word()}; nothing half-written is left.", 130)
    if isinstance(error, Late):
        return LATE
    if isinstance(error, InputError):
        return _complain(str(error), 2)
    if isinstance(error, InfeasibleError):
        return _complain(str(error), 1)
    if isinstance(error, BrokenPipeError):
        return 0
    if isinstance(error, OSError):  # a name too long, a full disk: whatever the system refuses and no command foresaw
        place = str(error.filename or "a file")[:120]
        return _complain(
            f"{place} must be usable; the system says: {error.strerror or error}. Check path and space.", 2
        )
    from workbench.files.problem_code import fault_of_problem_code

    usage = as_usage(error)
    if usage is not None:
        return _complain(usage, 2)
    theirs = fault_of_problem_code(error)
    return _complain(_defect(error), 3) if theirs is None else _complain(theirs, 2)


def _defect(error: BaseException) -> str:
    """The sentence of an error that no command foresaw; its traceback goes to a file that only its owner reads."""
    import os
    import tempfile
    import traceback

    called = " ".join(map(repr, sys.argv[1:]))
    text = f"workbench {called}\nPython {sys.version}\n\n{''.join(traceback.format_exception(error))}"
    try:
        descriptor, place = tempfile.mkstemp(prefix="workbench-", suffix="-traceback.txt")
        with os.fdopen(descriptor, "w", encoding="utf-8", errors="backslashreplace") as file:
            file.write(text)
    except OSError as refusal:
        place = f"no file ({refusal.strerror})"
    what = f"{type(error).__name__}: {str(error)[:200]}".rstrip(": ")
    return (
        f"internal error, a defect of the workbench and not of your input ({what}). The traceback is in {place}; "
        "please report it to the developers together with the files you gave."
    )


def _complain(sentence: str, code: int) -> int:
    from workbench.machine.terminal import printable

    print(printable(" ".join(sentence.split())), file=sys.stderr)  # noqa: T201
    return code


def __getattr__(name: str):
    """`app`, for those who look at the commands (the guide's reference); it is built when it is asked for."""
    if name != "app":
        raise AttributeError(name)
    from workbench.commands.app import app

    return app
