"""Nonlinear least squares: the best parameters and their uncertainty."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Residuals = Callable[[Array], Array]

STEPS = 60
"""Steps at most; a fit that needs more has not found the minimum."""
CONVERGENCE_TOLERANCE = 1e-5
"""A step that lowers the cost by less than this share of it is the last, unless it was damped."""
DAMPING, HARDER, EASIER, UNDAMPED = 1e-4, 10.0, 0.1, 1e-8
"""Damping of the first step, its factors after a step that failed and one that helped, and the value that counts as
undamped: strongly correlated values move by much smaller steps when damped."""
MAX_DAMPING = 1e12
HUBER = 2.5
"""A residual beyond this many standard deviations counts less: it is an error of another kind."""


@dataclass(frozen=True, slots=True)
class Fit:
    """The best parameters.

    Attributes:
        values: One per parameter.
        standard_errors: Of each; NaN where the measurements do not determine it.
        residual: Root mean square of the residuals of the measurements, robust.
        converged: Whether a minimum was found.
    """

    values: Array
    standard_errors: Array
    residual: float
    converged: bool


def fit(residuals: Residuals, start: Array, prior_sd: Array, scales: Array, alike: float = 1.0) -> Fit:
    """Fit parameters to measurements by the method of Levenberg and Marquardt.

    Args:
        residuals: Computes the residuals of the measurements for parameters, all in the same unit.
        start: First guess, which is also the expectation where the measurements give no information.
        prior_sd: How uncertain the first guess is; infinite where only the measurements count.
        scales: A small change of each parameter, for derivatives.
        alike: Number of residuals that share one error and count as one measurement.
    """
    values, damping = start.astype(np.float64), DAMPING
    known = np.sqrt(alike) / prior_sd
    errors = residuals(values)
    sigma = _spread(errors)
    cost = _cost(errors, sigma, (values - start) * known)
    converged = False
    for _ in range(STEPS):
        normal, gradient = _normal(residuals, values, errors, sigma, (values - start) * known, known, scales)
        while damping < MAX_DAMPING:
            step = np.linalg.solve(normal + damping * np.diag(np.diag(normal)), -gradient)
            tried = residuals(values + step)
            tried_cost = _cost(tried, sigma, (values + step - start) * known)
            if tried_cost < cost:
                break
            damping *= HARDER
        else:
            converged = True
            break
        gained, cost, undamped = (cost - tried_cost) / cost, tried_cost, damping <= UNDAMPED
        values, errors, damping = values + step, tried, max(damping * EASIER, UNDAMPED / 10)
        sharper = _spread(errors)
        if gained < CONVERGENCE_TOLERANCE and undamped and sharper > 0.99 * sigma:
            converged = True
            break
        sigma = sharper
        cost = _cost(errors, sigma, (values - start) * known)
    normal, _ = _normal(residuals, values, errors, sigma, (values - start) * known, known, scales)
    with np.errstate(invalid="ignore"):
        standard_errors = np.sqrt(alike * np.diag(np.linalg.inv(normal)))
    return Fit(values, standard_errors, sigma, converged)


def _spread(errors: Array) -> float:
    """Return the standard deviation of the residuals, from their median size so that outliers do not count."""
    return max(1e-9, float(1.4826 * np.median(np.abs(errors))))


def _weights(errors: Array, sigma: float) -> Array:
    return np.asarray(np.minimum(1.0, HUBER * sigma / np.maximum(np.abs(errors), 1e-12)))


def _cost(errors: Array, sigma: float, away: Array) -> float:
    scaled = np.abs(errors) / sigma
    huber = np.where(scaled <= HUBER, scaled**2, HUBER * (2 * scaled - HUBER))
    return float(huber.sum() + (away**2).sum())


def _normal(
    residuals: Residuals, values: Array, errors: Array, sigma: float, away: Array, known: Array, scales: Array
) -> tuple[Array, Array]:
    """Return the matrix of the normal equations, and half the gradient of the cost."""
    columns = []
    for i, scale in enumerate(scales):
        ahead = values.copy()
        ahead[i] += scale
        columns.append((residuals(ahead) - errors) / scale)
    slopes = np.stack(columns, axis=1)
    weighted = slopes * (_weights(errors, sigma) / sigma**2)[:, None]
    return weighted.T @ slopes + np.diag(known**2), weighted.T @ errors + away * known
