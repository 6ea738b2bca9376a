"""What the certificates of a registered standard predict for a day, at each nominal."""

from __future__ import annotations

from datetime import date

from labctl.answers.standards import DriftPrediction
from labctl.metrology.certificate_drift import CertifiedValue, Prediction, predicted
from labctl.store import RegisteredStandard


def nominals_of(standard: RegisteredStandard) -> list[float | None]:
    """Return the nominals that the newest certificate states, in its order; none without a certificate."""
    return [point.nominal for point in standard.in_force[-1].points] if standard.in_force else []


def prediction_at(standard: RegisteredStandard, nominal: float | None, on: date) -> Prediction | None:
    """Return the prediction at a nominal; None where no certificate states it."""
    values = [
        CertifiedValue(each.calibrated, point.value, point.u, each.adjusted)
        for each in standard.in_force
        for point in each.points
        if point.nominal == nominal
    ]
    return predicted(values, on) if values else None


def predictions_of(standard: RegisteredStandard, on: date) -> list[tuple[float | None, Prediction]]:
    """Return nominal and prediction for each nominal of the newest certificate."""
    predictions = [(nominal, prediction_at(standard, nominal, on)) for nominal in nominals_of(standard)]
    return [(nominal, each) for nominal, each in predictions if each is not None]


def prediction_answer(nominal: float | None, prediction: Prediction) -> DriftPrediction:
    """Return a prediction as an answer."""
    drift = prediction.drift
    return DriftPrediction(
        nominal=nominal, on=prediction.on, value=prediction.value, u=prediction.u,
        per_year=None if drift is None else drift.per_year, u_per_year=None if drift is None else drift.u_per_year,
        certificates=0 if drift is None else drift.certificates,
        birge_ratio=None if drift is None else drift.birge_ratio, why=prediction.why,
    )  # fmt: skip
