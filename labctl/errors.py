"""The error tree of labctl. One clear line each: what, where, the value, its unit, the limit, and what to do.

LabctlError              exit 2, HTTP 400
├── BadInput             a file, an option or a request is wrong; nothing was changed
│   ├── BadRecording     in a recording: names file, column, row and what was expected
│   │   └── BadFile      everything that is wrong with a log file, one line each
│   ├── StartNotConfirmed    a real bench starts only after a person has confirmed that it is clear   HTTP 422
│   ├── DataRefused      the data are certainly wrong, or a fit makes them worse     HTTP 422
│   ├── BadBench         in a bench file
│   └── BadCalibrationFile   edited, truncated or of an unknown format
├── BenchUnconfirmed         a service has ended and its bench is not known to be safe      exit 1
├── NotFound             no such unit, recording, calibration, campaign            HTTP 404
│   └── NotCertified     the unit has calibrations, but none is in force           HTTP 404, exit 1
├── CalibrationWithdrawn     a calibration was revoked, or its certificate was withdrawn: do not use it    exit 1
├── CalibrationOverdue       a calibration in a bundle is past its due date            exit 1
├── BundleExpired            a bundle is older than it may be                       exit 1
├── NotEnoughData        the model asks for more than the recording holds; says how much more    HTTP 422
├── Conflict             another process holds it, or it is already so             HTTP 409
│   ├── CertificationRefused   there are objections to a version; they can be overridden      HTTP 409
│   ├── VersionTaken     another calibration of the unit got this number meanwhile    HTTP 409
│   └── BenchBusy        another campaign or process drives the bench now             HTTP 409
├── NotAllowed           the key's role may not do this, or the request came a way it may not    HTTP 403
│   └── NotIdentified    no key was given, or it is not one in force                             HTTP 401
├── ReadOnly             this process only reads the database: what would change something is refused   HTTP 403
├── TooLarge             a request carries more than this service takes              HTTP 413
├── BenchSilent          the bench process does not answer; the bench may move       HTTP 503
│   └── NotStopped       a stop was asked for, and it is not known that the bench stands    HTTP 503, exit 1
├── NotRecorded          the bench stands, but that is not written down yet      exit 0
├── Overloaded           there is no room for a request now; it may come again soon              HTTP 503
├── TooBusy              as much is computed, and waits, as there is place for; says when to ask again   HTTP 429
├── ComputationEnded     a worker process ended before its result: memory, time, a crash     HTTP 503
└── StoreError           the database cannot be used: newer, damaged, locked         HTTP 503
    ├── DatabaseUnreachable     its server does not answer: it is restarted, or the network is cut     HTTP 503
    └── DiskFull         nothing was stored                                 HTTP 507
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

    from labctl.answers.json_object import JsonObject
    from labctl.withdrawal import Withdrawn


class LabctlError(Exception):
    """Any failure that one line explains to a user."""

    status = 400  #: HTTP
    exit_status = 2  #: exit code of the command line; 1 where a valid question is answered by no
    slug = "error"  #: last part of the problem document's `type`

    @property
    def members(self) -> JsonObject:
        """What the problem document has beside the members of every one, as JSON."""
        return {}


class BadInput(LabctlError):
    """A file, an option or a request is wrong; nothing was changed."""

    slug = "bad-input"


class BadRecording(BadInput):
    """A recording is wrong; the text names file, column, row and what was expected."""

    slug = "bad-recording"


class BadFile(BadRecording):
    """A log file is wrong; nothing was imported. `problems`: everything that is wrong with it, one line each."""

    slug = "bad-file"

    def __init__(self, text: str, problems: Sequence[str] = (), path: str = "") -> None:
        super().__init__(text)
        self.problems = list(problems)
        self.path = path

    @classmethod
    def of(cls, path: Path | str, problems: Sequence[str]) -> BadFile:
        """Return the error about a file; its text has the first problem and says how many more there are."""
        more = f" (and {len(problems) - 1} more)" if len(problems) > 1 else ""
        return cls(f"{path}: {problems[0]}{more}", problems, str(path))

    @property
    def members(self) -> JsonObject:
        """The problems."""
        return {"problems": list(self.problems)}


class DataRefused(BadInput):
    """What is asked for would be wrong with certainty, by the data's own evidence; it can be insisted on.

    `warnings`: everything that is wrong, as JSON; the text has the first.
    """

    status = 422
    slug = "data-refused"

    def __init__(self, text: str, warnings: Sequence[Mapping[str, object]] = ()) -> None:
        super().__init__(text)
        self.warnings = list(warnings)

    @property
    def members(self) -> JsonObject:
        """The warnings."""
        return {"warnings": self.warnings}


class StartNotConfirmed(BadInput):
    """A real bench starts only after a person has confirmed that it is clear; nothing has moved.

    `questions`: what is still to be confirmed, check -> question.
    """

    status = 422
    slug = "start-not-confirmed"

    def __init__(self, text: str, questions: Mapping[str, str] | None = None) -> None:
        super().__init__(text)
        self.questions = dict(questions or {})

    @property
    def members(self) -> JsonObject:
        """The questions that are open."""
        return {"questions": self.questions}


class BadBench(BadInput):
    """A bench file is wrong."""

    slug = "bad-bench"


class BadCalibrationFile(BadInput):
    """A calibration file was edited, truncated, or is of an unknown format."""

    slug = "bad-calibration-file"


class OtherConfiguration(BadInput):
    """A unit is set otherwise than when its calibration was measured."""

    slug = "other-configuration"


class Stopped(LabctlError):
    """A person stopped what ran here, by Ctrl-C or a signal; the text says how the bench was left."""

    exit_status = 130
    slug = "stopped"


class BenchUnconfirmed(LabctlError):
    """A service has ended and it is not known that its bench is in the safe state; the text says what is not."""

    exit_status = 1
    slug = "bench-in-doubt"


class NotFound(LabctlError):
    """No such unit, recording, calibration or campaign."""

    status = 404
    slug = "not-found"


class NotCertified(NotFound):
    """The unit has no calibration in force."""

    exit_status = 1
    slug = "not-certified"


class CalibrationOverdue(LabctlError):
    """A calibration in a bundle is past the date until which it is valid."""

    exit_status = 1
    slug = "calibration-overdue"


class BundleExpired(LabctlError):
    """A bundle of calibrations is past the date until which it may be used."""

    exit_status = 1
    slug = "bundle-expired"


class CalibrationWithdrawn(LabctlError):
    """A calibration was revoked, or its certificate was withdrawn; raised by the client of a service.

    `notice` has date, person and reason; `content` is the file that the service sent nevertheless, None from a check.
    """

    exit_status = 1
    slug = "calibration-withdrawn"

    def __init__(self, text: str, notice: Withdrawn | None = None, content: bytes | None = None) -> None:
        super().__init__(text)
        self.notice = notice
        self.content = content


class NotEnoughData(LabctlError):
    """The model asks for more than the recording holds; the text says how much more."""

    status = 422
    slug = "not-enough-data"


class Conflict(LabctlError):
    """Another process or user holds it, or it is already so."""

    status = 409
    slug = "conflict"


class BenchBusy(Conflict):
    """Another campaign or another process drives the bench now. It may be free later."""

    slug = "bench-busy"


class VersionTaken(Conflict):
    """Another calibration of the unit got this number meanwhile; build it again with the next one."""

    slug = "version-taken"


class CertificationRefused(Conflict):
    """There are objections to certifying a version; they can be overridden with a reason."""

    slug = "certification-refused"


class BenchSilent(LabctlError):
    """The bench process does not answer: what the bench does is not known."""

    status = 503
    slug = "bench-silent"


class NotStopped(BenchSilent):
    """A stop was asked for, and it is not known that the table stands: a person has to use the stop switch."""

    exit_status = 1
    slug = "not-stopped"


class NotRecorded(LabctlError):
    """The bench stands, but that could not be written down yet; the process that drives it next does it."""

    exit_status = 0
    slug = "not-recorded"


class StoreError(LabctlError):
    """The database cannot be used: newer than the code, damaged, locked, or the disk is full.

    `cause` says what happened, without what became of the act that met it.
    """

    status = 503
    slug = "store"

    def __init__(self, text: str, *, cause: str = "") -> None:
        super().__init__(text)
        self.cause = cause or text


class OldSchema(StoreError):
    """The database is of an earlier version; it is migrated when a person asks for it, and a service starts."""

    slug = "old-schema"


class DatabaseUnreachable(StoreError):
    """The server of the database does not answer; nothing was stored, and it can be tried again."""

    slug = "database-unreachable"


class DiskFull(StoreError):
    """The disk is full; nothing was stored."""

    status = 507
    slug = "disk-full"


class NotAllowed(LabctlError):
    """No key, a wrong one, or one whose role may not do this."""

    status = 403
    slug = "not-allowed"


class NotIdentified(NotAllowed):
    """No key was given, or it is not one in force."""

    status = 401
    slug = "not-identified"


class ReadOnly(LabctlError):
    """This service only reads; nothing was changed.

    `acts_at`: the address of the service that takes the request, None where it is not known here.
    """

    status = 403
    slug = "read-only"

    def __init__(self, text: str, acts_at: str | None = None) -> None:
        super().__init__(text)
        self.acts_at = acts_at

    @property
    def members(self) -> JsonObject:
        """The address."""
        return {"acts_at": self.acts_at}


class TooLarge(LabctlError):
    """A request carries more than this service takes."""

    status = 413
    slug = "too-large"


class Overloaded(LabctlError):
    """There is no room for a request now; it may come again soon."""

    status = 503
    slug = "overloaded"
    retry_after_s = 5


class TooBusy(LabctlError):
    """The service computes as much as it can, and as much waits; ask again later.

    `retry_after_s`: in about how many seconds there is place again.
    """

    status = 429
    slug = "too-busy"

    def __init__(self, text: str, retry_after_s: int = 1) -> None:
        super().__init__(text)
        self.retry_after_s = retry_after_s


class ComputationEnded(LabctlError):
    """A computation was ended before its result: it needed too much memory or time, or its process died."""

    status = 503
    slug = "computation-ended"
