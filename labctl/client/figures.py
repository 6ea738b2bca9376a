"""What the figures of the pages show, for scripts: each answer, and each point computed again from raw readings.

A notebook cell that a page gives calls these methods.
"""

from __future__ import annotations

from collections.abc import Sequence

from labctl.answers.points import FigurePointResponse, PointFigure, PointResponse, TrendQuantity
from labctl.answers.recordings import AllanResponse, TraceResponse
from labctl.answers.residuals import ResidualsResponse
from labctl.answers.units import TrendResponse
from labctl.client.connection import ClientPart, part
from labctl.service_connection import json_of


class FigureMethods(ClientPart):
    """Requests for figures, and for their points."""

    def residuals(self, serial: str, version: int, *, recordings: Sequence[int]) -> ResidualsResponse:
        """Return what the model of a version, fitted to recordings, leaves of each data set, deg/s."""
        path = f"/api/units/{part(serial)}/calibrations/{version}/residuals"
        response = self._connection.request("GET", path, params={"recordings": list(recordings)})
        return ResidualsResponse.model_validate(json_of(response))

    def point(
        self,
        serial: str,
        version: int,
        *,
        recording: int,
        dataset: int,
        axis: str,
        figure: PointFigure = "residual",
        recordings: Sequence[int] = (),
    ) -> PointResponse:
        """Return one data set of a figure, and its numbers computed again from the raw readings.

        `figure` is "residual" (of the model fitted to `recordings`, default: to `recording`) or "comparison" (the
        version without refitting).
        """
        path = f"/api/units/{part(serial)}/calibrations/{version}/point"
        query = {
            "recording": recording, "dataset": dataset, "axis": axis, "figure": figure, "recordings": list(recordings),
        }  # fmt: skip
        return PointResponse.model_validate(json_of(self._connection.request("GET", path, params=query)))

    def allan(self, recording: int, *, dataset: int | None = None) -> AllanResponse:
        """Return the Allan deviation of each axis at rest, deg/s; default: of the longest section at rest."""
        query = {} if dataset is None else {"dataset": dataset}
        response = self._connection.request("GET", f"/api/recordings/{recording}/allan", params=query)
        return AllanResponse.model_validate(json_of(response))

    def allan_point(
        self, recording: int, *, axis: str, tau_s: float, dataset: int | None = None
    ) -> FigurePointResponse:  # fmt: skip
        """Return the deviation of an axis at an averaging time of the figure, s, computed again from the readings."""
        return self._figure_point(f"recordings/{recording}/allan/point", axis=axis, tau_s=tau_s, dataset=dataset)

    def trace(
        self, recording: int, channel: str, *, from_s: float | None = None, until_s: float | None = None,
        points: int = 2000,
    ) -> TraceResponse:  # fmt: skip
        """Return least, largest and mean reading of a channel in at most `points` bins of a window, s."""
        query = {"channel": channel, "from_s": from_s, "until_s": until_s, "points": points}
        parameters = {name: value for name, value in query.items() if value is not None}
        response = self._connection.request("GET", f"/api/recordings/{recording}/trace", params=parameters)
        return TraceResponse.model_validate(json_of(response))

    def trace_point(
        self, recording: int, channel: str, *, t_s: float, from_s: float | None = None, until_s: float | None = None,
        points: int = 2000,
    ) -> FigurePointResponse:  # fmt: skip
        """Return the bin of a trace at its time, s, computed again from its readings."""
        return self._figure_point(
            f"recordings/{recording}/trace/point", channel=channel, t_s=t_s, from_s=from_s, until_s=until_s,
            points=points,
        )  # fmt: skip

    def mean_point(self, recording: int, dataset: int, channel: str) -> FigurePointResponse:
        """Return the kept mean of a channel in a data set, computed again from the readings."""
        return self._figure_point(f"recordings/{recording}/datasets/{dataset}/mean", channel=channel)

    def trend(self, serial: str, *, version: int | None = None, limit_dps: float | None = None) -> TrendResponse:
        """Return what a version (default: the first) leaves of each recording of a unit, and its drift per year."""
        query = {"version": version, "limit_dps": limit_dps}
        parameters = {name: value for name, value in query.items() if value is not None}
        response = self._connection.request("GET", f"/api/units/{part(serial)}/trend", params=parameters)
        return TrendResponse.model_validate(json_of(response))

    def trend_point(
        self, serial: str, *, recording: int, quantity: TrendQuantity, axis: str = "", version: int | None = None
    ) -> FigurePointResponse:  # fmt: skip
        """Return what a version leaves of a recording, computed again from every reading of it."""
        return self._figure_point(
            f"units/{part(serial)}/trend/point", recording=recording, quantity=quantity, axis=axis,
            version=version,
        )  # fmt: skip

    def _figure_point(self, path: str, **query: str | float | None) -> FigurePointResponse:
        parameters = {name: value for name, value in query.items() if value is not None}
        return FigurePointResponse.model_validate(
            json_of(self._connection.request("GET", f"/api/{path}", params=parameters))
        )
