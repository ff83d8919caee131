"""Usage errors of typer and click in the words of this package: field, value, what is allowed."""

from __future__ import annotations

import re
from difflib import get_close_matches
from typing import Any

import typer

from ..errors import MISSING, Fact, InvalidInput

# Typer brings its own click, of whose errors it exports only some; UsageError is the class above BadParameter.
UsageError: Any = typer.BadParameter.__base__


def as_invalid_input(error: Any) -> Exception:
    """The error that says the same as a ``UsageError`` does, in one line."""
    context = error.ctx
    where = getattr(context, "command_path", "tendonrod")
    see = f"see {where} --help"
    match type(error).__name__:
        case "NoSuchOption":
            near = get_close_matches(error.option_name, _option_names(context), n=1)
            hint = f"did you mean {near[0]}?" if near else see
            return InvalidInput("option", Fact(error.option_name), f"an option of {where}: {hint}")
        case "MissingParameter":
            return InvalidInput(_name(error.param), MISSING, f"given; {see}")
        case "BadOptionUsage":
            allowed = "followed by a value" if "requires" in error.message else "given without a value"
            return InvalidInput(error.option_name, MISSING if "requires" in error.message else Fact("..."), allowed)
    if found := re.search(r"No such command '(.*?)'", error.message):
        return _no_such_command(found[1], list(context.command.commands))
    if found := re.search(r"unexpected extra argument\S* \((.*)\)", error.message):
        takes = ", ".join(_name(each) for each in context.command.params if each.param_type_name == "argument")
        return InvalidInput("argument", found[1], f"left out: {where} takes {takes or 'no argument'}; {see}")
    return typer.BadParameter(error.format_message())


def _no_such_command(name: str, known: list[str]) -> InvalidInput:
    near = get_close_matches(name, known, n=1, cutoff=0.4)
    hint = f"; did you mean {near[0]}?" if near else ""
    return InvalidInput("command", name, f"one of {', '.join(known)}{hint}")


def _option_names(context: Any) -> list[str]:
    if context is None:
        return []
    return [name for each in context.command.get_params(context) for name in each.opts if name.startswith("--")]


def _name(parameter: Any) -> str:
    """As the user types it: --option, or the argument's placeholder."""
    options = [name for name in parameter.opts if name.startswith("-")]
    return options[-1] if options else parameter.metavar or parameter.name.upper()
