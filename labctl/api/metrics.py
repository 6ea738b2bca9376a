"""The figures of a service in Prometheus's text format: every metric with its help and its type."""

from __future__ import annotations

from collections.abc import Iterator

from prometheus_client import CollectorRegistry, ProcessCollector, generate_latest
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

from labctl.api.request_log import RequestFigures
from labctl.log.setup import held_back
from labctl.services.lab_service import LabService


class ServiceCollector(Collector):
    """Reads the figures of a service when they are asked for: counts of rows, none of their content."""

    def __init__(self, service: LabService, requests: RequestFigures) -> None:
        self._service, self._requests = service, requests

    def describe(self) -> list[Metric]:
        """Return nothing: what is registered here reads no database before it is asked."""
        return []

    def collect(self) -> Iterator[Metric]:
        """Yield every metric."""
        figures = self._service.metrics()
        by_state = figures.campaigns
        yield GaugeMetricFamily("labctl_units", "Units in the database", value=figures.units)
        yield GaugeMetricFamily(
            "labctl_units_overdue", "Units whose certification in force has ended", value=figures.overdue
        )
        yield GaugeMetricFamily(
            "labctl_units_due_30d",
            "Units whose certification ends within 30 days, or has ended",
            value=figures.due_soon,
        )
        standards = GaugeMetricFamily("labctl_standards", "Reference standards in each state", labels=["state"])
        for name, count in sorted(figures.standards.items()):
            standards.add_metric([name], count)
        yield standards
        yield GaugeMetricFamily(
            "labctl_check_gyros_out_of_limits",
            "Check gyros whose newest result is out of its control limits",
            value=figures.check_gyro_alarms,
        )
        yield GaugeMetricFamily("labctl_campaigns", "Campaigns in the database", value=sum(by_state.values()))
        yield GaugeMetricFamily("labctl_campaigns_failed", "Campaigns that failed", value=by_state.get("failed", 0))
        states = GaugeMetricFamily("labctl_campaigns_by_state", "Campaigns in each state", labels=["state"])
        for state, count in sorted(by_state.items()):
            states.add_metric([state], count)
        yield states
        yield GaugeMetricFamily(
            "labctl_campaign_running", "1 while a campaign runs on this service's bench, else 0", value=figures.running
        )
        yield GaugeMetricFamily(
            "labctl_bench_heard_seconds", "Time since the last answer of the bench process", value=figures.heard_s
        )
        yield from self._of_requests()
        yield from _of_the_log(self._requests.held_back)

    def _of_requests(self) -> Iterator[Metric]:
        ended = CounterMetricFamily(
            "labctl_http_requests", "Requests that ended, by method and class of status", labels=["method", "status"]
        )
        for (method, status), count in sorted(self._requests.ended.items()):
            ended.add_metric([method, status], count)
        yield ended


def _of_the_log(of_requests: int) -> Iterator[Metric]:
    lost, repeated = held_back()
    repeated += of_requests
    yield CounterMetricFamily(
        "labctl_log_records_lost", "Number of log records of the web process that could not be written", value=lost
    )
    yield CounterMetricFamily(
        "labctl_log_records_held_back",
        "Log records that were left out because they repeat an earlier record",
        value=repeated,
    )


def text_of(service: LabService, requests: RequestFigures) -> bytes:
    """Return the figures of a service and of its web process."""
    registry = CollectorRegistry()
    registry.register(ServiceCollector(service, requests))
    ProcessCollector(registry=registry)
    return generate_latest(registry)
