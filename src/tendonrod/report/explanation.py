"""What would explain the errors of trials, a `Diagnosis`, as the page of `tendonrod validate` tells it."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

from ..measurement.diagnosis import Diagnosis
from ..measurement.thinning import ordinal
from .chapter import Cell, Number, Picture, Table, mm
from .typeset import values


def explanations(causes: Mapping[str, Diagnosis]) -> list[dict[str, Any]]:
    """Of each robot, by its name, what would explain its errors: sentences, table, and a picture where any was fitted.

    The answers stand in the summary; with which poses they were found, and the warning, beside table and picture.
    """
    found = []
    for k, (name, diagnosis) in enumerate(causes.items(), 1):
        file = "causes" if len(causes) == 1 else f"causes-{k}"
        _, *answers, warning = (f"{values(each[0].upper() + each[1:])}." for each in diagnosis.sentences)
        known: dict[str, Any] = {"poses": diagnosis.count, "outliers": diagnosis.outliers, "rmse": mm(diagnosis.rmse)}
        known |= {"every": ordinal(diagnosis.every) if diagnosis.every > 1 else None}
        known |= {"robot": name, "answers": answers, "warning": warning}
        found.append(known | {"table": _table(file, diagnosis), "picture": _picture(file, diagnosis)})
    return found


def _picture(name: str, found: Diagnosis) -> Picture | None:
    from ..plot.causes import causes_figure

    fitted = any(each.fit is not None for each in found.alone)
    return Picture(name=name, draw=partial(causes_figure, found)) if fitted else None


def _table(name: str, found: Diagnosis) -> Table:
    rows: list[list[Cell]] = []
    for each in found.alone:
        known: list[Cell] = [Number(100.0 * each.explained, 1), mm(each.rmse)] if each.fit is not None else ["–", "–"]
        rows.append([each.name, *known, values(each.told)])
    for k, each in enumerate(found.together[1:], 2):
        names = " + ".join(cause.name for cause in found.together[:k])
        rows.append([names, Number(100.0 * each.explained, 1), mm(each.rmse), values(each.told)])
    header = ("cause", "of the squared error (%)", "RMSE left (mm)", "with, or why not")
    return Table(name=name, header=header, rows=rows)
