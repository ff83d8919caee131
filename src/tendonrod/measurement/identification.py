"""`identify`: numbers of robot and bench from measured trials by robust nonlinear least squares, and how sure they are.

Iteratively reweighted Gauss-Newton: between changes of the weights the whitened errors are minimised by SciPy's trust
region method with the engine's exact derivatives. Huber's weights act on the distance of a whole pose; a pose further
than `REJECTED` does not count. Covariance: that of an M-estimator (Huber, Ronchetti 2009, 7.6), scaled by the errors
that were found. Derivation: docs/identification.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..errors import InvalidInput, NotConverged, one_of
from .determinacy import check_determined, sentences
from .misfit import Misfit
from .prediction import Prediction, Predictor
from .registration import registered
from .setup import Setup
from .trial import Trial
from .unknowns import Unknown, unknowns

HUBER = {3: 3.0, 6: 3.9}  # in standard deviations of a pose; 98 % as efficient as least squares under normal noise
REJECTED = {3: 6.0, 6: 7.0}
ROUNDS = 15  # of the weights
LIMITS: Any = {"method": "dogbox", "xtol": 1e-7, "ftol": 1e-9, "gtol": 1e-12, "max_nfev": 60}  # in each
COARSE = {"xtol": 1e-2, "ftol": 1e-2}
SETTLED = 1e-2  # change from round to round, relative to the standard error
Watch = Callable[[int, int, str], None]


@dataclass(frozen=True, kw_only=True, eq=False)
class Fit:
    """Identified numbers of robot and bench, and how sure they are; SI, arrays read-only, m unknowns, N poses.

    values, standard_errors (m,), low, high (m,): 95 % confidence. covariance, correlation (m, m). scale: errors
    relative to the noise that the trials state; near 1 where model and noise explain all. where (N, 3): trial, sample,
    tracker of each pose; errors (N, 3) m, world, measured less predicted; weights (N,), 1 for full, 0 for one that does
    not count. distance_before, distance (N,): of body points, m, with ``before`` and with ``setup``. sentences: what
    the data can't tell apart, what lies at its bound and the like. evaluations: of the model on all samples.
    """

    trials: tuple[Trial, ...]
    unknowns: tuple[Unknown, ...]
    before: Setup
    setup: Setup
    values: np.ndarray
    covariance: np.ndarray
    scale: float
    quantile: float
    where: np.ndarray
    errors: np.ndarray
    weights: np.ndarray
    distance_before: np.ndarray
    distance: np.ndarray
    sentences: tuple[str, ...]
    evaluations: int
    solves: int
    orientations: bool
    loss: str
    problem: Problem = field(repr=False)
    noise: tuple[np.ndarray, np.ndarray] = field(repr=False)  # (N, d) standard deviations, (N, d, T) slopes

    def __repr__(self) -> str:
        told = (f"{u.name} = {u.told(x)} ± {u.told(e, 2)}" for u, x, e in zip(*self._columns(), strict=True))
        return f"Fit({', '.join(told)}; RMSE {1e3 * self.rmse_before:.3g} -> {1e3 * self.rmse:.3g} mm)"

    def _columns(self):
        return self.unknowns, self.values, self.standard_errors

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the unknowns."""
        return tuple(each.name for each in self.unknowns)

    def __getitem__(self, name: str) -> float:
        """The value of one unknown, SI."""
        return float(self.values[self.index(name)])

    def index(self, name: str) -> int:
        """Which unknown has this name. Raises `InvalidInput`."""
        return self.names.index(one_of("name", name, self.names))

    @cached_property
    def standard_errors(self) -> np.ndarray:
        """(m,) SI."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def low(self) -> np.ndarray:
        """(m,) lower end of the 95 % confidence intervals."""
        return self.values - self.quantile * self.standard_errors

    @property
    def high(self) -> np.ndarray:
        """(m,) upper end."""
        return self.values + self.quantile * self.standard_errors

    @property
    def correlation(self) -> np.ndarray:
        """(m, m)."""
        return self.covariance / np.outer(self.standard_errors, self.standard_errors)

    @property
    def used(self) -> np.ndarray:
        """(N,) whether a pose counts."""
        return self.weights > 0.0

    @property
    def rmse(self) -> float:
        """Root mean square distance of the poses that count, m."""
        return float(np.sqrt(np.mean(self.distance[self.used] ** 2)))

    @property
    def rmse_before(self) -> float:
        """The same poses with the numbers before, m."""
        return float(np.sqrt(np.mean(self.distance_before[self.used] ** 2)))

    @property
    def outliers(self) -> np.ndarray:
        """(k, 3) trial, sample, tracker of the poses that do not count."""
        return self.where[~self.used]


def identify(
    trials: Sequence[Trial],
    free: Sequence[str],
    *,
    setup: Setup | None = None,
    orientations: bool = False,
    loss: str = "huber",
    watch: Watch | None = None,
) -> Fit:
    """The numbers ``free`` of robot and bench that explain the trials best.

    free: names of `Setup`'s numbers and of the robot's (`Robot.parameters`). setup: where to start, and what is held.
    orientations: whether measured orientations count beside positions. loss: "huber", or "squares" without robustness.
    watch(done, of at most, what) is told of each evaluation. Trials without T_world_field are registered first.

    Raises `InvalidInput` by name, also where the data cannot determine what was asked, and `NotConverged` where the
    model has no equilibrium at the start or the fit does not settle.
    """
    one_of("loss", loss, ("huber", "squares"))
    before = setup or Setup()
    problem = Problem(registered(checked(trials)), tuple(free), before, orientations, watch)
    fit = fitted(problem, loss)
    problem.watch = None  # profiles and cross-validation tell their own progress
    return fit


def checked(trials: Sequence[Trial]) -> tuple[Trial, ...]:
    """``trials`` as a tuple. Raises `InvalidInput` where they are none."""
    if isinstance(trials, Trial):
        return (trials,)
    if not isinstance(trials, Sequence) or not trials or not all(isinstance(each, Trial) for each in trials):
        raise InvalidInput("trials", trials, "one or more Trial")
    return tuple(trials)


class Problem:
    """Errors and derivatives of all poses as functions of the unknowns, in multiples z of what is plausible."""

    def __init__(
        self, trials: tuple[Trial, ...], free: tuple[str, ...], setup: Setup, orientations: bool, watch: Watch | None
    ) -> None:
        self.unknowns = unknowns(free, trials, setup)
        self.trials, self.free, self.setup, self.watch = trials, free, setup, watch
        self.misfit = Misfit(trials, orientations)
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
                return np.full(weights.size * self.misfit.d + part.size, np.inf)
            white = self.misfit.whitened(e[..., None], sigma, G, weights)[:, 0]
            return np.append(white, drawn * (part - self.start[free]))

        def slopes(part: np.ndarray) -> Any:
            X, _ = self.misfit.slopes(self.at(full(part)))
            white = self.misfit.whitened((X * self.unit)[..., free], sigma, G, weights)
            return np.vstack([-white, drawn * np.eye(part.size)])

        if not free.any():
            return z, float(np.sum(errors(z[free]) ** 2))
        bounds = self.low[free], self.high[free]
        start = np.clip(z[free], *bounds)
        limits = LIMITS | COARSE if drawn else LIMITS
        found = least_squares(errors, start, slopes, bounds, **limits)  # pyright: ignore[reportArgumentType]
        return full(found.x), 2.0 * float(found.cost)


def fitted(problem: Problem, loss: str) -> Fit:
    """The fit, from the start of ``problem``; see `identify`."""
    misfit, z, before = problem.misfit, problem.start, problem.setup
    start = problem.at(z)
    e, (X, G) = misfit.errors(start), misfit.slopes(start)
    distance_before = misfit.body_distances(start, before.holder)
    sigma, weights = misfit.noise(e), np.ones(len(e))
    check_determined(problem.unknowns, misfit.whitened(X, misfit.noise(np.zeros_like(e)), G, weights), problem.trials)
    far, _ = _weights(misfit.distances(e, sigma, G), misfit.d, loss)
    z, _ = problem.minimise(z, sigma, G, weights, drawn=max(1.0, far))  # else numbers little felt there may run away
    step = np.inf
    for _ in range(ROUNDS):
        last, kept = z, weights
        z, _ = problem.minimise(z, sigma, G, weights)
        found = problem.at(z)
        e, (X, G) = misfit.errors(found), misfit.slopes(found)
        sigma = misfit.noise(e)
        distances = misfit.distances(e, sigma, G)
        scale, weights = _weights(distances, misfit.d, loss)
        white = misfit.whitened(X * problem.unit, sigma, G, weights)
        step = float(np.sqrt(np.einsum("i,ij,j->", z - last, white.T @ white, z - last)))
        if step < SETTLED * scale and np.abs(weights - kept).max() < 0.05:
            break
    else:
        advice = "free fewer numbers, or start nearer by giving them in the setup"
        raise NotConverged(
            status="the identification did not settle", load_factor=1.0, residual=float(step), advice=advice
        )
    full = misfit.whitened(X, sigma, G, (weights > 0.0).astype(float))
    m, n = len(z), int((weights > 0.0).sum()) * misfit.d
    check_determined(problem.unknowns, full / scale, problem.trials, z * problem.unit)
    covariance = _spread(distances, weights, misfit.d, scale) * n / max(1, n - m) * np.linalg.inv(full.T @ full)
    setup = problem.setup_at(z)
    fit = Fit(
        trials=problem.trials, unknowns=problem.unknowns, before=before, setup=setup, values=z * problem.unit,
        covariance=covariance, scale=scale, quantile=_quantile(n - m), where=misfit.where, errors=e[:, :3],
        weights=weights, distance_before=distance_before, distance=misfit.body_distances(found, setup.holder),
        sentences=(), evaluations=problem.evaluations, solves=problem.solves, orientations=misfit.orientations,
        loss=loss, problem=problem, noise=(sigma, G),
    )  # fmt: skip
    for array in (fit.values, covariance, misfit.where, weights, fit.errors, distance_before, fit.distance):
        array.setflags(write=False)
    return replace(fit, sentences=sentences(fit, full))


def _weights(distances: np.ndarray, d: int, loss: str) -> tuple[float, np.ndarray]:
    """(scale, weights): the noise's scale by the median, and Huber's weights of the distances relative to it."""
    from scipy.stats import chi2

    if loss == "squares":
        return float(np.sqrt(np.mean(distances**2) / d)), np.ones_like(distances)
    scale = float(np.sqrt(np.median(distances**2) / chi2.median(d))) or 1.0
    far = distances / scale
    return scale, np.where(far > REJECTED[d], 0.0, np.minimum(1.0, HUBER[d] / np.maximum(far, 1e-12)))


def _spread(distances: np.ndarray, weights: np.ndarray, d: int, scale: float) -> float:
    """Variance of a whitened error as the M-estimator passes it on: mean(psi^2) / mean(psi')^2."""
    used = weights > 0.0
    w, far = weights[used], distances[used]
    slope = np.where(w < 1.0, w * (1.0 - 1.0 / d), 1.0)  # Huber's psi = w e: its divergence / d
    return float(np.mean((w * far) ** 2) / d / np.mean(slope) ** 2)


def _quantile(freedom: int) -> float:
    from scipy.stats import t

    return float(t.ppf(0.975, max(1, freedom)))
