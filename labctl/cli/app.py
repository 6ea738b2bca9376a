"""The command line: every command under its name."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from typing import Annotated

import typer

from labctl.acting_user import Actor, acting
from labctl.cli.asked_command import part_for
from labctl.cli.command_log import log_of_command
from labctl.cli.commands import (
    accelerometer,
    audit,
    batches,
    bench,
    bundle,
    calibrations,
    campaign,
    campaign_control,
    criticism,
    database,
    diagnosis,
    effects,
    environment,
    fleet,
    inspection,
    keys,
    live,
    magnetometer,
    noise,
    plugins,
    recordings,
    schedule,
    seal_key,
    sensors,
    server,
    signing_key,
    standards,
    units,
    wire_logs,
)
from labctl.cli.commands.documents import certificate, certificate_list, datasheet, reproduction, uncertainty
from labctl.cli.error_reporting import one_clear_line
from labctl.cli.interrupts import process_of_one_command
from labctl.config import os_user

app = typer.Typer(
    name="labctl",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
    help="Calibrate gyroscopes: run a test bench, fit an error model, compare the model with the measurements, "
    "serve the calibration.",
)
app.add_typer(bench.app, name="bench")
app.add_typer(plugins.driver_app, name="driver")
app.add_typer(campaign.app, name="campaign")
campaign.app.add_typer(schedule.app, name="schedule")
campaign_control.add_to(campaign.app)
recordings.export_app.command("bundle")(bundle.export_bundle)
app.add_typer(recordings.export_app, name="export")
app.add_typer(keys.app, name="key")
app.add_typer(audit.app, name="audit")
app.add_typer(seal_key.app, name="seal-key")
app.add_typer(signing_key.app, name="signing-key")
app.add_typer(certificate_list.app, name="certificates")
app.add_typer(certificate.app, name="certificate")
app.add_typer(standards.app, name="standards")
app.add_typer(sensors.app, name="sensors")
app.add_typer(environment.app, name="environment")
app.add_typer(batches.app, name="batches")
app.add_typer(fleet.app, name="fleet")
COMMANDS: dict[str, Callable[..., None]] = {
    "demo": server.demo,
    "serve": server.serve,
    "stop": server.stop,
    "replay": wire_logs.replay,
    "simulator": server.simulator,
    "simulate": recordings.simulate,
    "import": recordings.import_,
    "inspect": inspection.inspect,
    "live": live.live,
    "allan": noise.allan,
    "orientation": noise.orientation,
    "accelerometer": accelerometer.accelerometer,
    "magnetometer": magnetometer.magnetometer,
    "fit": calibrations.fit,
    "effects": effects.effects,
    "plugins": plugins.plugins,
    "verify": criticism.verify,
    "criticise": criticism.criticise,
    "diagnose": diagnosis.diagnose,
    "improve": criticism.improve,
    "ladder": criticism.ladder,
    "trend": units.trend,
    "reproduce": reproduction.reproduce,
    "datasheet": datasheet.datasheet,
    "units": units.units,
    "certify": calibrations.certify,
    "release": calibrations.release,
    "revoke": calibrations.revoke,
    "certifications": calibrations.certifications,
    "calibration": calibrations.calibration,
    "uncertainty": uncertainty.uncertainty,
    "compensate": calibrations.compensate,
    "backup": database.backup,
    "check": database.check,
    "migrate": database.migrate,
    "move-database": database.move_database,
}
for name, command in COMMANDS.items():
    app.command(name)(command)


def _version(is_wanted: bool) -> None:
    if is_wanted:
        from importlib.metadata import version

        typer.echo(f"labctl {version('labctl')}")
        raise typer.Exit


@app.callback()
def everywhere(
    context: typer.Context,
    show: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    """Take the options that need no command; whatever is done is done in the name of the user who typed it."""
    del show
    context.with_resource(acting(Actor(os_user(), "command line")))
    if context.invoked_subcommand != "serve":  # which has a log of its own
        with one_clear_line():
            context.with_resource(log_of_command("command"))


def open_missing_streams() -> None:
    """Open empty standard streams where the process has none, as its next files would get their numbers.

    What is written to standard error would go into these files, and a child process would take them for its own.
    """
    for number in (0, 1, 2):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # the lowest number that is free


def main() -> None:
    """Run the command line; the process ends with the command."""
    open_missing_streams()
    with process_of_one_command():
        part_for(app, sys.argv[1:])()
