"""What is fitted to the recordings of a campaign when it is done, and what the result is compared with."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from procedures.recipe.rules import Number, Table, Yes

#: Names are known to what fits, not to a recipe: `labctl campaign plan` and the start of a campaign check them.
ModelName = Annotated[str, Field(min_length=1, max_length=100)]
MAX_COMPARED = 10


class FitLimits(Table):
    """Largest figures of a draft that passes; absent: not limited."""

    heldout_rms_dps: Number | None = Field(default=None, gt=0)  #: at temperatures left out of the fit
    max_error_dps: Number | None = Field(default=None, gt=0)  #: of any data set, for each axis, draft applied
    #: Corrected rate by the draft against that by the version in force, at any data set, for each axis.
    drift_dps: Number | None = Field(default=None, gt=0)


class FitRules(Table):
    """A campaign that is done ends in a draft: a calibration version of each unit that no person has certified."""

    model: ModelName | None = None  #: absent: the effects alone
    effects: tuple[ModelName, ...] = Field(default=(), max_length=50)  #: beside the model
    type_prior: Yes = False  #: whether what other calibrated units of the unit's type say is added to the fit
    compare: tuple[ModelName, ...] = Field(default=(), max_length=MAX_COMPARED)  #: further models, fitted, not kept
    criticise: Yes = True  #: whether a verdict is made
    against: Yes = True  #: whether the version in force is applied without refitting, and its drift computed
    limits: FitLimits = FitLimits()

    @model_validator(mode="after")
    def _whole(self) -> FitRules:
        """Refuse a fit of nothing, and a limit without what it limits."""
        if self.model is None and not self.effects:
            raise ValueError('name a model (model = "bias_scale") or effects (effects = ["bias"])')
        if self.limits.drift_dps is not None and not self.against:
            raise ValueError(
                "limits.drift_dps compares with the version in force, but against = false excludes "
                "that comparison; leave out one of the two"
            )
        return self
