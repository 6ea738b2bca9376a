"""Which published model a recording can be fitted with: what is proposed after an import."""

from __future__ import annotations

from labctl.errors import NotEnoughData
from labctl.fitting.data.fit_data import FitData, fit_data_of
from labctl.fitting.estimation.axis_design import axis_design
from labctl.fitting.estimation.published.tables import models_of
from labctl.fitting.estimation.requirements import require_enough_data
from labctl.fitting.models.presets import POSES, preset_for
from labctl.fitting.numeric.least_squares import rank_of
from labctl.recording import Recording

#: Presets, the fullest first, for one axis and for several; the first that a recording determines is proposed.
ONE_AXIS = ("ojeda2000", "bias_scale", "single_temperature", "bias_temperature", "bias")
SEVERAL_AXES = ("yang2018", "bias_scale", "single_temperature", "bias_temperature", "bias")
#: At rest nothing is learned of the scale factor.
AT_REST = ("bias_temperature", "bias")
TURNED = ("turns", "bias")


def suggested_model(points: Recording) -> str:
    """Return the name of the fullest published model that the means of a recording determine.

    Raises NotEnoughData where there is not one complete data set.
    """
    if points.info.kind == "coefficients":
        return models_of(points)[0]
    if points.info.motion == POSES:
        return POSES
    data = fit_data_of(points)
    names: tuple[str, ...] = AT_REST
    if data.channels.table_rate_dps().any() and data.info.motion == "turns":
        names = TURNED
    elif data.channels.table_rate_dps().any():
        names = SEVERAL_AXES if len(data.info.axes) > 1 else ONE_AXIS
    return next((name for name in names[:-1] if _is_determined(data, name)), names[-1])


def _is_determined(data: FitData, name: str) -> bool:
    try:
        model, rows = preset_for(name, []).build(data)
        training = data.take(rows)
        require_enough_data(training, model)
        designs = [axis_design(training, model, axis).columns for axis in training.outputs]
    except NotEnoughData:
        return False
    return all(0 < rank_of(columns) == columns.shape[1] < len(columns) for columns in designs)
