"""`identify`: numbers of robot and bench from measured trials by robust nonlinear least squares, and how sure they are.

Iteratively reweighted Gauss-Newton: between changes of the weights the whitened errors are minimised by SciPy's trust
region method with the engine's exact derivatives. Huber's weights act on the distance of a whole pose; a pose further
than `REJECTED` does not count. Covariance: that of an M-estimator (Huber, Ronchetti 2009, 7.6), scaled by the errors
that were found. Derivation: docs/identification.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ..errors import Fact, InvalidInput, TendonrodError, one_of
from .determinacy import check_determined, sentences
from .fit_problem import ROUNDS, Problem, Watch, seen_base
from .registration import registered, registrations
from .setup import Setup
from .trial import Trial
from .unknowns import Unknown

HUBER = {3: 3.0, 6: 3.9}  # in standard deviations of a pose; 98 % as efficient as least squares under normal noise
REJECTED = {3: 6.0, 6: 7.0}
SETTLED = 1e-2  # change from round to round, relative to the standard error


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
        """(m,) lower end of the 95 % confidence intervals, not beyond what can be."""
        bounds = [each.low for each in self.unknowns]
        return np.maximum(bounds, self.values - self.quantile * self.standard_errors)

    @property
    def high(self) -> np.ndarray:
        """(m,) upper end."""
        bounds = [each.high for each in self.unknowns]
        return np.minimum(bounds, self.values + self.quantile * self.standard_errors)

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
    base_tracker: bool = False,
    watch: Watch | None = None,
) -> Fit:
    """The numbers ``free`` of robot and bench that explain the trials best.

    free: names of `Setup`'s numbers and of the robot's (`Robot.parameters`). setup: where to start, and what is held.
    orientations: whether measured orientations count beside positions. loss: "huber", or "squares" without robustness.
    base_tracker: whether what a tracker on the base sees of the exit counts for base_x ... base_roll, where the world
    does not hang on it; its holder must then be mounted as the trial says. watch(done, of at most, what) is told of
    each evaluation. Trials without T_world_field are registered first, and the registration's uncertainty is in the
    intervals.

    Raises `InvalidInput` by name, also where the data cannot determine what was asked, `NotConverged` where the model
    has no equilibrium at the start, and `TendonrodError` where the fit does not settle.
    """
    one_of("loss", loss, ("huber", "squares"))
    trials = checked(trials)
    problem = Problem(registered(trials), tuple(free), setup or Setup(), orientations, registrations(trials))
    problem.watch = watch
    if base_tracker:
        problem.prior = seen_base(problem)
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


def fitted(problem: Problem, loss: str) -> Fit:
    """The fit, from the start of ``problem``; see `identify`."""
    misfit, z, before = problem.misfit, problem.start, problem.setup
    start = problem.at(z)
    e, (X, G) = misfit.errors(start), misfit.slopes(start)
    distance_before = misfit.body_distances(start, before.holder)
    sigma, weights = misfit.noise(e), np.ones(len(e))
    check_determined(problem.unknowns, misfit.whitened(X, misfit.noise(np.zeros_like(e)), G, weights), problem.trials)
    if e.size <= len(z):
        allowed = f"fewer: {len(e)} used pose{'s' * (len(e) > 1)} cannot determine {len(z)}"
        raise InvalidInput("free", Fact(", ".join(problem.free)), allowed)
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
        told = ", ".join(f"{u.name} {u.told(x)}" for u, x in zip(problem.unknowns, z * problem.unit, strict=True))
        raise TendonrodError(
            f"the identification did not settle in {problem.evaluations} evaluations, last at {told}: free fewer "
            "numbers, start them nearer, or look for samples that do not belong"
        )
    full = misfit.whitened(X, sigma, G, (weights > 0.0).astype(float))
    full = np.vstack([full, np.diag(problem.prior.per_error)])
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
