"""All commands under one roof."""

from __future__ import annotations

import typer

from labctl.cli import bench, calibrations, campaign, recordings, serving

app = typer.Typer(
    name="labctl",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
    help="Calibrate gyroscopes: run the bench, fit, hold the model against the measurements, serve the calibration.",
)
app.add_typer(bench.app, name="bench")
app.add_typer(campaign.app, name="campaign")
app.add_typer(recordings.export_app, name="export")
for command in (recordings.import_, recordings.simulate):
    app.command(command.__name__.rstrip("_"))(command)
for command in (
    calibrations.fit,
    calibrations.effects,
    calibrations.certify,
    calibrations.revoke,
    calibrations.calibration,
    calibrations.compensate,
):
    app.command(command.__name__)(command)
for command in (serving.serve, serving.simulator, serving.demo):
    app.command(command.__name__)(command)


def main() -> None:
    """Run the command line."""
    app()
