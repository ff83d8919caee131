"""`Problem`: errors and derivatives of all poses as functions of the unknowns, and the step to their least squares."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from ..errors import InvalidInput, NotConverged
from ..rotation import log_so3
from .misfit import Misfit
from .prediction import Prediction, Predictor
from .registration import GIVEN, Registration, base_registration, seen_exit
from .setup import Setup
from .trial import Trial
from .unknowns import unknowns

ROUNDS = 15  # of the weights, at most
LIMITS: Any = {"method": "dogbox", "xtol": 1e-7, "ftol": 1e-9, "gtol": 1e-12, "max_nfev": 60}  # in each
COARSE = {"xtol": 1e-2, "ftol": 1e-2}
_BASE = ("base_x", "base_y", "base_z", "base_tilt_x", "base_tilt_y", "base_roll")
Watch = Callable[[int, int, str], None]


class Prior(NamedTuple):
    """What is known of the unknowns beside the poses: values (m,), SI, and 1 / their standard error, 0 for nothing."""

    values: np.ndarray
    per_error: np.ndarray


def seen_base(problem: Problem) -> Prior:
    """What trackers on the base see of the exit, in worlds that do not hang on them.

    Raises `InvalidInput` where none does.
    """
    values, weight = np.zeros((2, len(problem.free)))
    for trial, registration in zip(problem.trials, problem.known, strict=True):
        pose = seen_exit(trial) if registration.source == GIVEN else None
        if pose is None:
            continue
        shift, turn = base_registration([replace(trial, T_world_field=None)]).standard_error
        seen = dict(zip(_BASE, [*pose[:3, 3], *log_so3(pose[:3, :3])], strict=True))
        for k, name in enumerate(problem.free):
            if name in seen:
                more = 1.0 / (shift if name in _BASE[:3] else turn) ** 2
                values[k] = (weight[k] * values[k] + more * seen[name]) / (weight[k] + more)
                weight[k] += more
    if not weight.any():
        allowed = "False: no tracker on the base tells of base_x ... base_roll in a world that does not hang on it"
        raise InvalidInput("base_tracker", True, allowed)
    return Prior(values, np.sqrt(weight))


class Problem:
    """Errors and derivatives of all poses as functions of the unknowns, in multiples z of what is plausible."""

    def __init__(
        self, trials: tuple[Trial, ...], free: tuple[str, ...], setup: Setup, orientations: bool,
        known: tuple[Registration, ...] = (), prior: Prior | None = None,
    ) -> None:  # fmt: skip
        self.unknowns = unknowns(free, trials, setup)
        self.trials, self.free, self.setup, self.known = trials, free, setup, known
        self.watch: Watch | None = None
        self.misfit = Misfit(trials, orientations, known)
        self.prior = prior or Prior(*np.zeros((2, len(free))))
        self.predictor = Predictor(trials, free)
        self.unit = np.array([each.plausible for each in self.unknowns])
        self.low = np.array([each.low for each in self.unknowns]) / self.unit
        self.high = np.array([each.high for each in self.unknowns]) / self.unit
        self.start = np.array([each.start for each in self.unknowns]) / self.unit
        self.evaluations, self.solves = 0, 0
        self._last: tuple[np.ndarray, Prediction] | None = None

    def setup_at(self, z: np.ndarray) -> Setup:
        """The setup with these unknowns."""
        return self.setup.changed(dict(zip(self.free, (z * self.unit).tolist(), strict=True)), self.trials)

    def at(self, z: np.ndarray) -> Prediction:
        """The prediction; that of the last z is kept."""
        if self._last is None or not np.array_equal(self._last[0], z):
            found = self.predictor(self.setup_at(z))
            self.evaluations, self.solves = self.evaluations + 1, self.solves + found.solves
            self._last = z.copy(), found
            self._tell(found)
        return self._last[1]

    def _tell(self, found: Prediction) -> None:
        if self.watch is not None:
            e = np.linalg.norm(self.misfit.errors(found)[:, :3], axis=1)
            done = ROUNDS * self.evaluations / (ROUNDS + self.evaluations)  # nobody knows how many there will be
            self.watch(
                round(100 * done), 100 * ROUNDS, f"evaluation {self.evaluations}, median {1e3 * np.median(e):.3g} mm"
            )

    def minimise(
        self, z: np.ndarray, sigma: np.ndarray, G: np.ndarray, weights: np.ndarray, held: int | None = None,
        drawn: float = 0.0,
    ) -> tuple[np.ndarray, float]:  # fmt: skip
        """(z with the least weighted squares, that sum); the unknown ``held`` stays where it is.

        drawn: how much a plausible departure from the start counts, in errors; then coarsely, to start from.
        """
        from scipy.optimize import least_squares

        free = np.arange(z.size) != (-1 if held is None else held)

        def full(part: np.ndarray) -> np.ndarray:
            whole = z.copy()
            whole[free] = part
            return whole

        def errors(part: np.ndarray) -> np.ndarray:
            try:
                e = self.misfit.errors(self.at(full(part)))
            except (NotConverged, InvalidInput):  # no equilibrium or no such robot: a shorter step is taken
                return np.full(weights.size * self.misfit.d + 2 * part.size, np.inf)
            white = self.misfit.whitened(e[..., None], sigma, G, weights)[:, 0]
            return np.concatenate([white, drawn * (part - self.start[free]), pull * (part - mean)])

        def slopes(part: np.ndarray) -> Any:
            X, _ = self.misfit.slopes(self.at(full(part)))
            white = self.misfit.whitened((X * self.unit)[..., free], sigma, G, weights)
            return np.vstack([-white, drawn * np.eye(part.size), np.diag(pull)])

        pull, mean = (self.prior.per_error * self.unit)[free], (self.prior.values / self.unit)[free]
        if not free.any():
            return z, float(np.sum(errors(z[free]) ** 2))
        bounds = self.low[free], self.high[free]
        start = np.clip(z[free], *bounds)
        limits = LIMITS | COARSE if drawn else LIMITS
        found = least_squares(errors, start, slopes, bounds, **limits)  # pyright: ignore[reportArgumentType]
        return full(found.x), 2.0 * float(found.cost)
