"""`profile`: how much worse the fit becomes when one number is held elsewhere and all others adapt."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .identification import Fit

REACH = (-3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0)  # standard errors


@dataclass(frozen=True, kw_only=True, eq=False)
class Profile:
    """One number held at ``values`` (q,), SI. others (q, m): all numbers as they adapt.

    rise (q,): growth of the weighted squares; the fit's own quadratic is ((value - best) / standard error)^2.

    low, high: 95 % interval by likelihood, NaN where the profile does not reach its level.
    """

    name: str
    values: np.ndarray
    rise: np.ndarray
    others: np.ndarray
    low: float
    high: float


def profile(fit: Fit, name: str) -> Profile:
    """The profile of one of the fit's numbers, weights held. Raises `InvalidInput` for another name."""
    i, problem, (sigma, G) = fit.index(name), fit.problem, fit.noise
    weights, unknown = fit.used.astype(float), fit.unknowns[i]
    best, least = problem.minimise(fit.values / problem.unit, sigma, G, weights)
    per_squared = _variance(fit, weights, i)
    follow = fit.covariance[:, i] / fit.covariance[i, i] / problem.unit * problem.unit[i]
    held = [best[i] + k * fit.standard_errors[i] / problem.unit[i] for k in REACH]
    held = [z for z in held if problem.low[i] < z < problem.high[i] or z == best[i]]
    found = [_held(fit, i, best + follow * (z - best[i]), weights) if z != best[i] else (best, least) for z in held]
    values = np.array(held) * problem.unit[i]
    rise = np.array([max(0.0, (squares - least) / per_squared) for _, squares in found])
    low, high = _crossings(values, rise, float(best[i] * problem.unit[i]), fit.quantile, unknown.low, unknown.high)
    others = np.array([z * problem.unit for z, _ in found])
    return Profile(name=name, values=values, rise=rise, others=others, low=low, high=high)


def _held(fit: Fit, i: int, z: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, float]:
    start = np.clip(z, fit.problem.low, fit.problem.high)
    start[i] = z[i]
    return fit.problem.minimise(start, *fit.noise, weights, held=i)


def _variance(fit: Fit, weights: np.ndarray, i: int) -> float:
    """Squares of whitened errors that count as one standard error squared."""
    X, _ = fit.problem.misfit.slopes(fit.problem.at(fit.values / fit.problem.unit))
    white = fit.problem.misfit.whitened(X, *fit.noise, weights)
    white = np.vstack([white, np.diag(fit.problem.prior.per_error)])
    return float(fit.covariance[i, i] / np.linalg.inv(white.T @ white)[i, i])


def _crossings(
    values: np.ndarray, rise: np.ndarray, best: float, quantile: float, lowest: float, highest: float
) -> tuple[float, float]:
    """Where the signed root of the rise passes the quantile; a side cut off by a bound ends there."""
    root = np.sign(values - best) * np.sqrt(rise)
    if np.any(np.diff(root) <= 0.0):
        return float("nan"), float("nan")
    ends = []
    for target, bound in ((-quantile, lowest), (quantile, highest)):
        beyond = root[0] > target if target < 0.0 else root[-1] < target
        at = bound if np.isfinite(bound) else float("nan")
        ends.append(at if beyond else float(np.interp(target, root, values)))
    return ends[0], ends[1]
