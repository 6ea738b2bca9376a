"""Peers on the same published files: scripts of autopilots, imucal, imu_tk, AllanTools, printed coefficients."""

from __future__ import annotations

import importlib
import io
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from types import ModuleType

import numpy as np

from labctl.recording import read_recording
from studies.real.answers import Commands
from studies.real.comparison import Compared
from studies.real.independent import cool_down, hand_turns, poses, warm_up
from studies.real.independent.files import AXES, PUBLISHED, Array, Found
from studies.real.independent.rests import rests
from studies.real.left_out import LeftOut, by_labctl, by_peers, points_of
from studies.real.published import FREEIMU_WORDS, IMUCAL_E, POSES

#: Readings per second in a burst, and over all (with the logger's pauses), as ArduPilot's script counts them.
PAN_HZ, FREEIMU_HZ = 50.0, 29.56
STILL_S = 45.0


@dataclass(frozen=True)
class Peer:
    """One line of the table: what a peer finds and what labctl finds on the same data."""

    data: str
    quantity: str
    peer: str
    theirs: str
    labctl: str
    says: str


def lines(found: Mapping[str, Compared]) -> Iterator[Peer]:
    """Yield the table's lines, from what labctl said of each recording."""
    yield from _at_rest()
    yield _printed_parabola(found["freeimu-warmup"])
    yield from _imucal(found)
    for name, published in POSES.items():
        yield from _poses(name, published.source, found[name])
    yield from _allan()


def _at_rest() -> Iterator[Peer]:
    t_s, warm, rates = warm_up.readings()
    window = np.unique((t_s // warm_up.MEAN_S).astype(np.int64), return_inverse=True)[1]
    means = warm_up.means(t_s, warm, rates)
    ours = by_labctl(read_recording(PUBLISHED.parent / "freeimu-warmup"), means)
    yield from _thermal("freeimu-warmup", by_peers((warm, rates, window), means, FREEIMU_HZ), ours)
    bursts = cool_down.bursts()
    ours = by_labctl(points_of("pan-cooldown"), bursts)
    yield from _thermal("pan-cooldown", by_peers(cool_down.readings(), bursts, PAN_HZ), ours)


def _thermal(name: str, peers: Mapping[str, LeftOut], ours: LeftOut) -> Iterator[Peer]:
    for peer, theirs in peers.items():
        for which, value, own in (
            ("each eighth", theirs.all_parts, ours.all_parts),
            ("six inner eighths of the range", theirs.inner, ours.inner),
        ):
            quantity = f"error at temperatures left out of the fit, {which}, deg/s"
            yield Peer(name, quantity, peer, f"{value:.4f}", f"{own:.4f}", _better(own, value))


def _better(ours: float, theirs: float) -> str:
    return f"labctl {'better' if ours < theirs else 'worse'}, ratio {ours / theirs:.2f}"


def _printed_parabola(found: Compared) -> Peer:
    """Compare the author's least-squares parabola at 11 temperatures of the range, in labctl's uncertainties."""
    warm = np.linspace(11.0, 28.5, 11)
    u = {row.quantity: row.labctl for row in found.rows}
    largest = 0.0
    for axis in AXES:
        names = [name for name in u if name.startswith(f"{axis}:")]
        ours = np.column_stack([np.ones(11), warm - 20, (warm - 20) ** 2]) @ [u[name].value for name in names]
        printed = np.polyval(FREEIMU_WORDS[axis], (warm - warm_up.ZERO_C) * warm_up.WORDS_PER_K) / warm_up.WORDS_PER_DPS
        largest = max(largest, float(np.abs(ours - printed).max()))
    quantity = "parabolas of x, y, z from 11 to 28.5 deg C, deg/s"
    u_bias = max(u[f"{axis}: bias at 20 deg C, deg/s"].u for axis in AXES)
    return Peer(
        "freeimu-warmup", quantity, "printed by its author", "3 parabolas", f"apart by {largest:.4f} at most",
        f"U(k=2) of the bias alone at 20 deg C is up to {2 * u_bias:.4f}",
    )  # fmt: skip


def _imucal(found: Mapping[str, Compared]) -> Iterator[Peer]:
    package = _installed("imucal")
    for name, (parts, rate_hz) in hand_turns.SESSIONS.items():
        ours = {row.quantity: row.labctl for row in found[name].rows}
        if package is not None:
            yield _matrices(name, f"imucal {_version('imucal')}", _by_imucal(package, parts(), rate_hz), ours)
        if name == "imucal-annotated":
            yield _matrices(name, "published with imucal", IMUCAL_E, ours)


def _matrices(name: str, peer: str, theirs: Array, ours: Found) -> Peer:
    names = [f"{axis} by rate about {about}, E, 1e-3" for axis in AXES for about in AXES]
    off = [abs(1e3 * value - ours[key].value) / ours[key].u for key, value in zip(names, theirs.ravel(), strict=True)]
    within = sum(each <= 2 for each in off)
    says = f"{within} of 9 within U(k=2), furthest {max(off):.2f} u"
    return Peer(name, "matrix of gains, 9 elements", peer, "9 numbers without uncertainty", "9 with U", says)


def _by_imucal(package: ModuleType, parts: hand_turns.Parts, rate_hz: float) -> Array:
    """Return E by the package; its turns are by -360 deg where the outputs fall, else by 360."""
    pandas = importlib.import_module("pandas")
    names = [f"{kind}_{axis}" for kind in ("gyr", "acc") for axis in AXES]
    frame = pandas.concat([
        pandas.DataFrame(np.hstack(part), columns=names, index=[name] * len(part[0])) for name, part in parts.items()
    ])  # fmt: skip
    way = float(np.sign(parts["x_rot"][0][:, 0].sum()))
    found = package.FerrarisCalibration(expected_angle=way * hand_turns.TURN_DEG).compute(
        package.ferraris_regions_from_df(frame), sampling_rate_hz=rate_hz, from_acc_unit="m/s^2", from_gyr_unit="deg/s"
    )
    return np.asarray(found.K_g @ found.R_g) - np.eye(3)


def _poses(name: str, source: str, found: Compared) -> Iterator[Peer]:
    published = POSES[name]
    ours = {row.quantity: row.labctl for row in found.rows}
    yield _matrices(name, source, 1e-3 * published.matrix, ours)
    session = poses.SESSIONS[name]()
    theirs = poses.off_by_deg(poses.moves_of(session, published.bias)[0], 1e-3 * published.matrix)
    quantity = "gravity after a move, off by, deg"
    by_labctl = ours[quantity].value
    yield Peer(
        name, quantity, "the same, with its bias", f"{theirs:.3f}", f"{by_labctl:.3f}", _better(by_labctl, theirs)
    )


def _allan() -> Iterator[Peer]:
    """Compare Allan deviations of the Xsens' first rest: `labctl allan FILE` beside AllanTools' overlapping ones."""
    package = _installed("allantools")
    if package is None:
        return
    session = poses.xsens()
    first = rests(session)[0]
    rates = session.rates[first.start : first.start + int(STILL_S * 100)]
    text = io.StringIO()
    np.savetxt(text, np.column_stack([np.arange(len(rates)) / 100.0, rates]), fmt="%.10g", delimiter=",",
               header="t_s,gyro_x,gyro_y,gyro_z", comments="")  # fmt: skip
    with TemporaryDirectory() as folder:
        path = Path(folder) / "still.csv"
        path.write_text(text.getvalue(), encoding="utf-8")
        answer = Commands(Path(folder)).json("allan", str(path))
    apart, count = 0.0, 0
    for k, axis in enumerate(AXES):
        curve = answer["axes"][f"gyro_{axis}"]
        taus, theirs, _, _ = package.oadev(rates[:, k], rate=100.0, data_type="freq", taus=np.array(curve["tau_s"]))
        assert np.allclose(taus, curve["tau_s"])
        apart = max(apart, float(np.max(np.abs(np.array(curve["deviation_dps"]) / theirs - 1))))
        count += len(taus)
    quantity = f"Allan deviations of {STILL_S:.0f} s at rest"
    peer = f"AllanTools {_version('allantools')}"
    yield Peer(
        "xsens",
        quantity,
        peer,
        f"{count} deviations",
        f"{count} deviations",
        f"apart by {apart:.0e} at most (five digits printed)",
    )


def _installed(name: str) -> ModuleType | None:
    try:
        return importlib.import_module(name)
    except ImportError:
        return None


def _version(name: str) -> str:
    from importlib.metadata import version

    return version(name)
