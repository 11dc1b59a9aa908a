"""The commands as one typer application, and what it says of arguments that cannot be."""

import os
import sys

import typer

from workbench.commands import COMMANDS

app = typer.Typer(
    name="workbench",
    help="Control design for magnetically levitated vehicles.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
for command in COMMANDS:
    app.command()(command)


def invoke(arguments: list[str] | None) -> int:
    """Runs the command that the arguments name and returns its exit code; what it raises goes to the caller."""
    if "_WORKBENCH_COMPLETE" in os.environ:
        app()  # the shell asks for completions; this does not return
    given = sys.argv[1:] if arguments is None else list(arguments)
    try:
        with typer.main.get_command(app).make_context("workbench", given) as context:
            code = context.command.invoke(context)
    except typer.Exit as leave:
        return leave.exit_code
    except Exception as error:
        if type(error).__name__ != "NoArgsIsHelpError":
            raise
        typer.echo(str(error), err=True)
        return 2
    return code if isinstance(code, int) else 0


def as_usage(error: BaseException) -> str | None:
    """The sentence of a refusal by typer; None for any other error."""
    message = getattr(error, "format_message", None)
    return None if message is None else f"{message()} Try 'workbench --help'."
