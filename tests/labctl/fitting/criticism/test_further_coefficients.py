"""Evidence against the further coefficients of a wider effect, and what it lets a verdict say."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import null_space
from scipy.stats import multivariate_normal

from labctl.fitting.criticism import Criticism, criticise
from labctl.fitting.criticism.evidence.further_coefficients import further_nats
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.models.presets import preset_for
from tests.helpers.simulated_recordings import single_axis


def test_it_is_the_ratio_of_two_normal_densities_of_what_is_beyond_the_simple_effect() -> None:
    """Witness: the densities by scipy, in a basis of the further directions by scipy."""
    rng = np.random.default_rng(3)
    root = rng.normal(size=(4, 4))
    covariance = 0.02 * root @ root.T
    through, simple = rng.normal(size=(4, 1)), np.array([2.0])
    size = np.array([1.0, 3.0, 0.5, 2.0])
    wider = through @ simple + rng.normal(scale=0.3, size=4)
    basis = null_space((through * size[:, None]).T)
    beyond, known = basis.T @ (wider * size), basis.T @ (covariance * np.outer(size, size)) @ basis
    prior_var = float(np.mean((through @ simple * size) ** 2))
    expected = multivariate_normal.logpdf(beyond, cov=known) - multivariate_normal.logpdf(
        beyond, cov=known + prior_var * np.eye(3)
    )
    assert further_nats(wider, covariance, through, simple, size) == pytest.approx(float(expected), rel=1e-9)


def test_what_is_not_known_says_nothing_and_what_is_there_speaks_for_the_wider_effect() -> None:
    through, simple, size = np.array([[1.0], [0.0]]), np.array([1.0]), np.ones(2)
    known = np.diag([1e-4, 1e-4])
    assert further_nats(np.array([1.0, 0.0]), known, through, simple, size) > 4.0
    assert further_nats(np.array([1.0, 0.2]), known, through, simple, size) < -100.0
    unknown = np.diag([1e-4, 1e4])
    assert abs(further_nats(np.array([1.0, 0.0]), unknown, through, simple, size)) < 1e-3
    assert further_nats(np.array([1.0]), np.eye(1), np.ones((1, 1)), simple, np.ones(1)) == 0.0


def _criticised(**hidden: float) -> Criticism:
    recording = single_axis(71001, **hidden)
    model, _ = preset_for("ojeda2000", []).build(fit_data_of(recording))
    return criticise(recording, model, full=False)


def test_a_warm_up_is_named_where_the_scale_factor_is_known_not_to_warm_up() -> None:
    """Self-heating contains it: the bias of a warm-up, and a scale factor that follows it."""
    verdict = _criticised(warm_up=0.57).verdict
    assert (verdict.form, verdict.groups) == ("missing", (("warm_up",),))


def test_self_heating_is_not_called_a_warm_up() -> None:
    verdict = _criticised(self_heating=1.0).verdict
    assert (verdict.form, verdict.groups) == ("missing", (("self_heating",),))
