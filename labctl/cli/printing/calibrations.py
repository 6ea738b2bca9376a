"""Fits, coefficients and certifications as text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from labctl.answers.certification import CertificationResponse, ReleaseRequestResponse
from labctl.answers.output_units import nominal_text
from labctl.cli.output import console, format_number, print_heading, print_warnings, table
from labctl.cli.printing.joint import print_joint
from labctl.fitting.numeric.rounding import rounded_to_uncertainty
from labctl.probability_text import share_text
from labctl.shown_unit import ShownUnit, shown_unit

if TYPE_CHECKING:
    from labctl.answers.calibrations import FitResponse
    from labctl.answers.fitted_model import Coefficients, Entry, HeldJson, TypePriorJson
    from labctl.answers.poses import PosesJson
    from labctl.answers.recording_head import OutputUnit


def print_fit(answer: FitResponse) -> None:
    """Print a fit for a person: the errors first, then the coefficients."""
    error = answer.error
    print_warnings(answer.warnings)
    print_heading(answer.serial, f" version {answer.version}: {answer.model.name}")
    console.print(f"  before             {format_number(error.raw_rms_dps)} deg/s RMS")
    console.print(f"  after              {format_number(error.rms_dps)} deg/s RMS")
    console.print(f"  held-out           {format_number(error.heldout_rms_dps)} deg/s RMS")
    for leg in error.heldout_by_leg:
        console.print(f"  {leg.tested + ' by ' + leg.fitted:<18} {format_number(leg.rms_dps)} deg/s RMS")
    console.print(f"  noise floor        {format_number(error.noise_floor_dps)} deg/s")
    low, high = answer.validity.temperature_c
    slow, fast = answer.validity.rate_dps
    rates = "any rate" if slow is None or fast is None else f"{slow:.4g} to {fast:.4g} deg/s"
    warm = "any temperature (none was measured)" if low is None or high is None else f"{low:.1f} to {high:.1f} deg C"
    console.print(f"  valid              {warm}, {rates}")
    _print_nominal(answer.output)
    if answer.model.held is not None:
        _print_held(answer.model.held)
    if answer.type_prior is not None:
        _print_type_prior(answer.type_prior)
    print_joint(answer.joint)
    for axis, content in answer.axes.items():
        coefficients = content["coefficients"]
        if isinstance(nodes := coefficients.get("temperature_c"), list):
            print_heading(f"\naxis {axis}", f": a table over {len(nodes)} temperatures")
            print_table(coefficients, answer)
            continue
        rows = table(f"axis {axis}", "coefficient", "unit", "value", "u", numbers=2)
        for name, entry in coefficients.items():
            (value, *_), (u, *_), _ = _at_nodes(entry)
            factor, unit_symbol = _unit_of(name, answer)
            shown = rounded_to_uncertainty(factor * value, None if u is None else factor * u)
            rows.add_row(name, unit_symbol, shown.value + shown.power, shown.u + shown.power if shown.u else "-")
        console.print(rows)
    for effect, quantities in answer.shapes.items():
        rows = table(effect, "quantity", "unit", "value", "u", numbers=2)
        for name, entry in quantities.items():
            shown = rounded_to_uncertainty(entry["value"], entry["u"])
            rows.add_row(name, entry["unit"], shown.value + shown.power, shown.u + shown.power if shown.u else "-")
        console.print(rows)
    if answer.poses is not None:
        print_poses(answer.poses)


def _print_nominal(outputs: Mapping[str, OutputUnit]) -> None:
    """Print the nominal scale factor of each axis, to which the coefficients are relative."""
    for axis, output in outputs.items():
        name = f"nominal, axis {axis}"
        console.print(f"  {name:<18} {nominal_text(output.unit, output.offset, output.scale)}", soft_wrap=True)


def _print_type_prior(prior: TypePriorJson) -> None:
    units = f"{prior['units']} other units of type {prior['type']} by {prior['model']}"
    if prior["is_used"]:
        console.print(f"  prior              {units} (p = {prior['p_value']:.2g})", soft_wrap=True)
    else:
        console.print(
            f"  prior              not used: the unit is unlike {units} (p = {prior['p_value']:.1g})", style="yellow",
            soft_wrap=True,
        )  # fmt: skip


def _print_held(held: HeldJson) -> None:
    """Print which coefficients were held at known values, and where these are from."""
    for axis, names in held["axes"].items():
        console.print(f"  held, axis {axis}       {', '.join(names)}", soft_wrap=True)
    console.print(f"  held values from   {held['source']}", soft_wrap=True)


def print_poses(poses: PosesJson) -> None:
    """Print what a calibration by hand says beside the gyro's coefficients: the accelerometer, rests and moves."""
    from labctl.fitting.poses.description import alignment_text

    rests, moves, held_out = poses["rests"], poses["moves"], poses["held_out"]
    rows = table("accelerometer", "axis", "coefficient", "unit", "value", "u", numbers=2)
    for axis, coefficients in poses["accelerometer"]["axes"].items():
        for name, entry in coefficients.items():
            factor, unit_symbol = shown_unit(entry["unit"], name)
            shown = rounded_to_uncertainty(factor * entry["value"], factor * entry["u"])
            rows.add_row(axis, name, unit_symbol, shown.value + shown.power, (shown.u or "-") + shown.power)
    console.print(rows)
    if (alignment := poses.get("alignment")) is not None:
        console.print(alignment_text(alignment), soft_wrap=True)
    console.print(
        f"{rests['count']} rests in {rests['poses']} poses; {moves['used']} of {moves['count']} turns used; gravity "
        f"after a turn off by {moves['residual_deg']:.2g} deg, held out by {held_out['rms_deg']:.2g} deg, "
        f"{share_text(held_out['within_2u'])} of it within U = 2 u; as exported, one bias and no g-sensitivity: "
        f"{moves['applied_rms_dps']:.2g} deg/s RMS",
        soft_wrap=True,
    )
    for left in moves["left_out"]:
        where = f"{left['from_s']:.1f} to {left['until_s']:.1f} s"
        console.print(f"  turn left out, from {where}: {left['why']}", style="yellow", soft_wrap=True)
    console.print(f"frame: {poses['accelerometer']['frame']}", style="dim", soft_wrap=True)
    console.print(f"not determined: {poses['not_determined']}", style="dim", soft_wrap=True)


#: What a certification has done, by whether the version was in force already.
_CERTIFIED = {
    None: "is now the calibration in force",
    "renewed": "was in force already; this certification is written in addition",
    "unchanged": "was in force already with the same facts; nothing was written",
}


def print_certification(answer: CertificationResponse | ReleaseRequestResponse) -> None:
    """Print an act of certifying or revoking and what was known of the version, or that it waits for its release."""
    if isinstance(answer, ReleaseRequestResponse):
        console.print(_waits(answer), soft_wrap=True)
        return
    done = "is no longer in force" if answer.act == "revoke" else _CERTIFIED[answer.already_in_force]
    console.print(f"{answer.serial} version {answer.version} {done} ({_persons(answer)}: {answer.reason})")
    if answer.act == "certify":
        console.print(f"  verdict: {_verdict(answer)}", soft_wrap=True)
        _print_causes_not_known(answer)
    if answer.uncertainty_unknown:
        text = f"  its uncertainty in use is unknown: {answer.uncertainty_unknown}"
        console.print(text, style="yellow", soft_wrap=True)
    _print_objections(answer)
    for number in answer.withdrawn_certificates:
        console.print(f"  certificate {number} is withdrawn", soft_wrap=True)
    for each in answer.fetched_by:
        when = f"{each.first_at:%Y-%m-%d %H:%M} to {each.last_at:%Y-%m-%d %H:%M} UTC"
        console.print(f"  fetched by {each.who}, {when}: notify them", soft_wrap=True)


def _persons(answer: CertificationResponse) -> str:
    """Return who acted, with the key of each person."""
    first = f"{answer.by}, key {answer.by_key}" if answer.by_key else answer.by
    if answer.released_by is None:
        return first
    return f"{first}; released by {answer.released_by}, key {answer.released_key} ({answer.release_reason})"


def _waits(request: ReleaseRequestResponse) -> str:
    return (
        f"{request.serial} version {request.version} waits for a second person, with another key than "
        f"{request.by_key} ({request.by}: {request.reason}); `labctl release {request.serial} {request.version}` "
        "puts it in force"
    )


def print_certifications(rows: Sequence[CertificationResponse], waiting: Sequence[ReleaseRequestResponse] = ()) -> None:
    """Print what waits for a second person, and acts, newest first."""
    for request in waiting:
        console.print(_waits(request), style="yellow", soft_wrap=True)
    if not rows:
        console.print("nothing has been certified yet")
    for row in rows:
        line = f"{row.at:%Y-%m-%d %H:%M} UTC  {row.act} version {row.version}  {_persons(row)}: {row.reason}"
        console.print(line, soft_wrap=True)
        if row.act == "certify":
            console.print(f"  verdict: {_verdict(row)}", soft_wrap=True)
            _print_causes_not_known(row)
        _print_objections(row)


def _verdict(answer: CertificationResponse) -> str:
    """Return the verdict that was kept with a certification, in words."""
    if answer.verdict is not None:
        when = f", {answer.verdict_at:%Y-%m-%d %H:%M} UTC" if answer.verdict_at else ""
        return f"{answer.verdict} (recording {answer.verdict_recording}{when}): {answer.verdict_text}"
    return f"none: {answer.verdict_reason}" if answer.verdict_reason else "not kept"


def _print_causes_not_known(answer: CertificationResponse) -> None:
    for text in answer.cause_not_known:
        console.print(f"  cause not known: {text}", soft_wrap=True)


def _print_objections(answer: CertificationResponse) -> None:
    for each in answer.objections:
        console.print(f"  overridden: {each['text']}", style="bold red", soft_wrap=True)


def print_table(coefficients: Coefficients, answer: FitResponse) -> None:
    """Print a coefficient table over temperature, one row per temperature, rounded to their uncertainties."""
    nodes, _, _ = _at_nodes(coefficients["temperature_c"])
    names = [name for name in coefficients if name != "temperature_c"]
    units = {name: _unit_of(name, answer) for name in names}
    titles = [f"{name}, {units[name].unit}" for name in names]
    rows = table("", "deg C", *titles, numbers=len(names) + 1)
    for index, node in enumerate(nodes):
        rows.add_row(f"{node:.2f}", *(_cell(coefficients[name], index, units[name].factor) for name in names))
    console.print(rows)


def _unit_of(name: str, answer: FitResponse) -> ShownUnit:
    """Return the unit in which a coefficient is printed on all axes."""
    entries = [_at_nodes(axis["coefficients"][name]) for axis in answer.axes.values() if name in axis["coefficients"]]
    return shown_unit(entries[0][2], name)


def _cell(entry: Entry, index: int, factor: float) -> str:
    values, us, _ = _at_nodes(entry)
    u = us[index]
    shown = rounded_to_uncertainty(factor * values[index], None if u is None else factor * u)
    return shown.value + shown.power


def _at_nodes(entry: Entry) -> tuple[list[float], list[float | None], str]:
    """Return values and uncertainties, a single one or one per node of a temperature table, and the unit."""
    if isinstance(entry, list):
        return entry, [None] * len(entry), "deg C"
    value, u = entry["value"], entry["u"]
    return value if isinstance(value, list) else [value], u if isinstance(u, list) else [u], entry["unit"]
