"""The front door: registers the commands, turns every error into one clear line and an exit code.

Exit codes: 0 done (whatever the verdict), 2 bad input or configuration, 3 service or database out of reach,
130 interrupted by ^C, 143 by SIGTERM, 1 for an error of ours. No traceback reaches a user.
"""

from __future__ import annotations

import contextlib
import io
import os
import signal
import sys
from datetime import UTC, datetime
from typing import Annotated, NoReturn, cast

import typer

from monitor.cli.environment import cache_dir, prepare_environment
from plant.errors import InputError, ReachError, TribowatchError

EXIT_BUG, EXIT_INPUT, EXIT_REACH, EXIT_INTERRUPTED, EXIT_PIPE, EXIT_TERMINATED = 1, 2, 3, 130, 141, 143
# typer may carry its own click: the class is reached through its public child
UsageError = cast(type[Exception], typer.BadParameter.__mro__[1])

app = typer.Typer(
    name="tribowatch",
    help="Watches the friction of machine axes; tells wear from lubrication from a wrong model.",
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _print_version(wanted: bool) -> None:
    """Print the installed version and stop."""
    if wanted:
        from importlib.metadata import version

        sys.stdout.write(f"tribowatch {version('tribowatch')}\n")
        raise typer.Exit


@app.callback(invoke_without_command=True)
def tribowatch(
    context: typer.Context,
    _version: Annotated[
        bool, typer.Option("--version", help="Print the version.", callback=_print_version, is_eager=True)
    ] = False,
) -> None:
    """Watches the friction of machine axes; tells wear from lubrication from a wrong model."""
    if context.invoked_subcommand is None:
        sys.stdout.write(context.get_help() + "\n")


def main(arguments: list[str] | None = None) -> NoReturn:
    """Entry point of `tribowatch` and of `python -m monitor`; never returns."""
    prepare_environment()
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")  # a terminal that has no ± or bars gets question marks
    with contextlib.suppress(ValueError):  # not the main thread: an embedding program keeps its own handlers
        signal.signal(signal.SIGTERM, _terminate)
    code = run_command(sys.argv[1:] if arguments is None else arguments)
    with contextlib.suppress(BrokenPipeError):
        sys.stdout.flush()
    sys.exit(code)


def run_command(arguments: list[str]) -> int:
    """Run one command line; gives the exit code, with errors said in one line on stderr."""
    try:
        outcome = app(args=arguments, prog_name="tribowatch", standalone_mode=False)
    except InputError as error:
        return _complain(arguments, error, EXIT_INPUT)
    except ReachError as error:
        return _complain(arguments, error, EXIT_REACH)
    except TribowatchError as error:
        return _complain(arguments, error, EXIT_BUG)
    except UsageError as error:
        return _complain_usage(error)
    except typer.Abort:
        if sys.stdin is not None and sys.stdin.isatty():
            return EXIT_INTERRUPTED
        unheard = InputError("asks before it goes on, and nobody answers here; --yes goes on without asking")
        return _complain(arguments, unheard, EXIT_INPUT)
    except KeyboardInterrupt:
        return EXIT_INTERRUPTED
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return EXIT_PIPE
    except Exception as error:
        return _complain_bug(arguments, error)
    return outcome if isinstance(outcome, int) else 0


def _terminate(_signal: int, _frame: object) -> NoReturn:
    """SIGTERM unwinds like ^C, so that sessions, children and files are closed."""
    raise SystemExit(EXIT_TERMINATED)


def _say(line: str) -> None:
    """One line on stderr, whatever line breaks the message has."""
    sys.stderr.write(" ".join(line.split()) + "\n")


def _complain(arguments: list[str], error: Exception, code: int) -> int:
    """Say what a user can mend."""
    command = next((word for word in arguments if not word.startswith("-")), "")
    _say(f"tribowatch {command}: {error}")
    return code


def _complain_usage(error: Exception) -> int:
    """Say what is wrong with the command line and where its help is."""
    context = getattr(error, "ctx", None)
    path = context.command_path if context is not None else "tribowatch"
    message = error.format_message() if hasattr(error, "format_message") else str(error)
    _say(f"{path}: {message} Help: {path} --help")
    return EXIT_INPUT


def _complain_bug(arguments: list[str], error: Exception) -> int:
    """An error of ours: the user gets one line, the details go to a file."""
    import platform
    import traceback

    folder = cache_dir() / "errors"
    detail = folder / f"{datetime.now(UTC):%Y%m%dT%H%M%S}-{os.getpid()}.log"
    text = f"tribowatch {' '.join(arguments)}\npython {platform.python_version()}\n\n{traceback.format_exc()}"
    where = "details could not be written"
    with contextlib.suppress(OSError):
        folder.mkdir(parents=True, exist_ok=True)
        detail.write_text(text)
        where = f"details in {detail}"
    _say(f"tribowatch: this should not have happened ({type(error).__name__}: {error}); {where}")
    return EXIT_BUG
