"""A PostgreSQL database of many units with certified calibrations and results of fleet jobs, for the benchmarks.

labctl itself writes the first unit: recording, fit, certification. The others are copies of its rows that the server
makes, with their own serial number, type and batch, and with documents that have their own hash. The trail of audit and
the chain of manifests have the first unit alone.
"""

from __future__ import annotations

from datetime import UTC, datetime

import numpy as np
import sqlalchemy as sa

from labctl.answers.calibrations import FitRequest
from labctl.answers.certification import CertifyRequest
from labctl.services.calibrations.certification import certify
from labctl.services.calibrations.fitting import fit_unit
from labctl.store import open_store
from labctl.store.schema import tables
from tests.helpers.recordings import points

AT = datetime(2026, 1, 5, 8, tzinfo=UTC)
FIRST = "G-0000000"
TYPES, BATCH = 20, 1000
#: The serial number of the n-th unit, as SQL.
SERIAL = "'G-' || lpad(n::text, 7, '0')"


def serial_of(n: int) -> str:
    """Return the serial number of the n-th unit."""
    return f"G-{n:07d}"


def fill(url: str, units: int) -> None:
    """Write the units into an empty database."""
    with open_store(url, write=True) as store:
        rate = np.linspace(-100.0, 100.0, 21)
        output = 1.01 * rate + 0.1 + 0.01 * np.sin(rate)
        store.recordings.add_import(points(rate, np.full(21, 25.0), output, serial=FIRST, model="FOG-00"), AT)
        fit_unit(store, FIRST, FitRequest(effects=["bias", "scale_factor"]), AT)
        reason = "an exception for a benchmark, which serves it and uses it nowhere"
        certify(store, FIRST, 1, CertifyRequest(by="benchmark", reason=reason, due_days=365, override=True), AT)
    engine = sa.create_engine(url)
    with engine.begin() as connection:
        for statement in _statements(connection):
            connection.execute(sa.text(statement), {"last": units - 1})
    with engine.connect().execution_options(isolation_level="AUTOCOMMIT") as connection:
        connection.exec_driver_sql("VACUUM (ANALYZE)")
    engine.dispose()


def _statements(connection: sa.Connection) -> list[str]:
    """Return the statements that copy the rows of the first unit to those from 1 to :last."""
    head = sa.select(tables.calibrations.c.id, tables.calibrations.c.recording_id)
    calibration, recording = connection.execute(head).one()
    document = f"(SELECT convert_from(document, 'UTF8') FROM calibrations WHERE id = {calibration})"
    digest = f"(SELECT hash FROM calibrations WHERE id = {calibration})"
    own = f"replace(whole, '{FIRST}', {SERIAL})"
    unhashed = f"replace({own}, '\"hash\":\"' || {digest} || '\",', '')"
    renamed = {"info", "answer", "assessment"}

    def copied(table: sa.Table, **changed: str) -> str:
        values = {c.name: f'"{c.name}"' for c in table.columns}
        values |= {
            name: f"replace({name}::text, '{FIRST}', {SERIAL})::json" for name in renamed if name in table.columns
        }
        values |= changed
        names = ", ".join(f'"{name}"' for name in values)
        return (
            f"INSERT INTO {table.name} ({names}) SELECT {', '.join(values.values())} "
            f"FROM {table.name} AS first, generate_series(1, :last) AS n "
        )

    hashed = f"encode(sha256(convert_to(rtrim({unhashed}, E'\\n'), 'UTF8')), 'hex')"
    columns = "job_id, serial, kind, state, newest, version, rms_dps, noise_floor_dps, verdict, named"
    results, each = f"INSERT INTO fleet_units ({columns})", "FROM generate_series(0, :last) AS n"
    judged = "CASE n % 5 WHEN 0 THEN 'missing' ELSE 'adequate' END"
    named = "CASE n % 5 WHEN 0 THEN '[\"warm_up\"]'::json ELSE '[]' END"
    done = "'local', 'b', 0, :last + 1, 'done'"
    jobs = 'INSERT INTO fleet_jobs (id, kind, request, engine, "by", created_at, units, state)'
    return [
        copied(tables.units, serial=SERIAL, model=f"'FOG-' || lpad((n % {TYPES})::text, 2, '0')",
               batch=f"'B-' || (n / {BATCH})"),
        copied(tables.recordings, id=f"{recording} + n", serial=SERIAL),
        copied(tables.calibrations, id=f"{calibration} + n", serial=SERIAL, recording_id=f"{recording} + n",
               hash="own.hash", document=f"convert_to(replace({own}, {digest}, own.hash), 'UTF8')")
        + f"CROSS JOIN {document} AS source(whole) CROSS JOIN LATERAL (SELECT {hashed} AS hash) AS own",
        copied(tables.calibration_recordings, calibration_id=f"{calibration} + n", recording_id=f"{recording} + n"),
        copied(tables.certifications, id="first.id + n", serial=SERIAL),
        f"{jobs} VALUES (1, 'fit', '{{}}', {done}), (2, 'criticise', '{{}}', {done})",
        f"{results} SELECT 1, {SERIAL}, 'fit', 'done', true, 1, 0.001 * (1 + (n % 7) * 0.3), 0.001, NULL, NULL {each}",
        f"{results} SELECT 2, {SERIAL}, 'criticise', 'done', true, 1, 0.001, 0.001, {judged}, {named} {each}",
        *(f"SELECT setval(pg_get_serial_sequence('{name}', 'id'), (SELECT max(id) FROM {name}))"
          for name in ("recordings", "calibrations", "certifications", "fleet_jobs")),
    ]  # fmt: skip
