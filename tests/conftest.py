"""The command line in this process, for all its tests; distances of phantoms are kept beside pytest's own cache."""

import json
import os
import signal
from pathlib import Path

import pytest

from tendonrod.cli import main

os.environ.setdefault("TENDONROD_CACHE", str(Path(__file__).parents[1] / ".pytest_cache" / "distances"))
NOTICES = ("tendonrod: compiling ", "tendonrod: computing the distances ")  # by whichever test comes first
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # as in the background; what tests start would inherit it
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture
def run(capsys):
    """Call the command line in this process; (exit status, standard output, standard error)."""

    def call(*arguments) -> tuple[int, str, str]:
        capsys.readouterr()
        status = main([str(each) for each in arguments])
        shown = capsys.readouterr()
        told = [line for line in shown.err.splitlines(keepends=True) if not line.startswith(NOTICES)]
        return status, shown.out, "".join(told)

    return call


@pytest.fixture
def result(run):
    """The JSON that a command prints; it must succeed and print nothing else to standard output."""

    def call(*arguments) -> dict:
        status, out, err = run(*arguments, "--json")
        assert status == 0, err
        return json.loads(out, parse_constant=lambda word: pytest.fail(f"{word} is no JSON"))

    return call


@pytest.fixture
def refused(run):
    """The one line on standard error of a command that must be refused as bad input."""

    def call(*arguments, status=2) -> str:
        got, out, err = run(*arguments)
        assert (got, out) == (status, ""), err
        assert err.startswith("tendonrod: error: ")
        assert err.count("\n") == 1
        assert err.endswith("\n")
        return err.removeprefix("tendonrod: error: ").rstrip("\n")

    return call
