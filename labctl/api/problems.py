"""Errors as problem documents (RFC 9457), one `type` per error class."""

from __future__ import annotations

import errno
import tempfile
from collections.abc import Callable, Mapping

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from starlette.exceptions import HTTPException

from instruments.errors import InstrumentError
from instruments.toml_documents import listed
from labctl.api.request_errors import MAX_ERRORS, in_words
from labctl.errors import DiskFull, LabctlError, NotIdentified, Overloaded, TooBusy, TooLarge
from procedures.contracts.errors import PlanRefused, ProcedureError, StalePrompt

#: How the framework says that the JSON reader gave up for another reason than a wrong character.
UNREADABLE = "There was an error parsing the body"
#: How it says that a field of a form that is no file is too long; the limit follows.
LARGE_PART = "Part exceeded maximum size of"
TYPE_PREFIX = "urn:labctl:problem:"


def problem(status: int, slug: str, title: str, detail: str, instance: str, **members: object) -> JSONResponse:
    """Make a problem document; `members` are those beside the usual ones."""
    body = {"type": TYPE_PREFIX + slug, "title": title, "status": status, "detail": detail, "instance": instance}
    body |= members
    return JSONResponse(body, status_code=status, media_type="application/problem+json")


def as_problem(error: LabctlError, path: str) -> JSONResponse:
    """Make the problem document of a LabctlError."""
    answer = problem(error.status, error.slug, _title(type(error)), str(error), path, **error.members)
    if isinstance(error, NotIdentified):
        answer.headers["WWW-Authenticate"] = 'Bearer realm="labctl"'
    if isinstance(error, Overloaded | TooBusy):
        answer.headers["Retry-After"] = str(error.retry_after_s)
    return answer


def _title(error: type[Exception]) -> str:
    return (error.__doc__ or error.__name__).split(";")[0].split(".")[0]


def _of_labctl(request: Request, error: LabctlError) -> JSONResponse:
    return as_problem(error, request.url.path)


def _of_an_instrument(request: Request, error: InstrumentError) -> JSONResponse:
    return problem(502, "instrument", _title(type(error)), str(error), request.url.path)


def _of_a_procedure(request: Request, error: ProcedureError) -> JSONResponse:
    if isinstance(error, StalePrompt):
        return problem(409, "stale-prompt", _title(type(error)), str(error), request.url.path)
    slug = "plan-refused" if isinstance(error, PlanRefused) else "recipe"
    return problem(400, slug, _title(type(error)), str(error), request.url.path)


def _of_the_request(request: Request, error: RequestValidationError) -> JSONResponse:
    errors = in_words(error.errors())
    detail = listed(f"{'.'.join(each['place'])}: {each['text']}" for each in errors)
    title = "The request does not match the API description (api-docs)"
    return problem(422, "bad-request", title, detail, request.url.path, errors=errors[:MAX_ERRORS])


def _of_a_number(request: Request, error: OverflowError) -> JSONResponse:
    text = f"a number is out of range ({error}); send a smaller one"
    return problem(400, "bad-input", "A number is too large", text, request.url.path)


def _of_a_text(request: Request, error: UnicodeEncodeError) -> JSONResponse:
    text = f"a text value has an incomplete character at position {error.start}; send valid Unicode"
    return problem(400, "bad-input", "A text is not valid Unicode", text, request.url.path)


def _of_the_system(request: Request, error: OSError) -> JSONResponse:
    if error.errno not in {errno.ENOSPC, errno.EDQUOT}:
        raise error
    place = error.filename or f"the folder for temporary files, {tempfile.gettempdir()}"
    text = f"{place}: the disk is full; nothing was stored. Free disk space, then send it again"
    return as_problem(DiskFull(text), request.url.path)


def _of_http(request: Request, error: HTTPException) -> JSONResponse:
    text = str(error.detail)
    too_many = error.status_code == 400 and text.startswith("Too many")  # parts of a form: the parser's own bound
    if error.status_code == TooLarge.status or too_many:
        return as_problem(TooLarge(text), request.url.path)
    if error.status_code == 400 and text.startswith(LARGE_PART):
        limit = text.removeprefix(LARGE_PART).strip(" .")
        return as_problem(
            TooLarge(f"a field of the form (such as column_map) is larger than the limit of {limit}; shorten it"),
            request.url.path,
        )
    if error.status_code == 400 and text == UNREADABLE:
        nested = (
            "the request's body cannot be read as JSON: it is nested too deeply, or a number has too many digits; "
            "correct it and send it again"
        )
        return problem(400, "bad-input", "The body cannot be read", nested, request.url.path)
    answer = problem(error.status_code, f"http-{error.status_code}", text, text, request.url.path)
    answer.headers.update(error.headers or {})
    return answer


HANDLERS: Mapping[type[Exception], Callable[..., JSONResponse]] = {
    LabctlError: _of_labctl,
    InstrumentError: _of_an_instrument,
    ProcedureError: _of_a_procedure,
    RequestValidationError: _of_the_request,
    OverflowError: _of_a_number,
    UnicodeEncodeError: _of_a_text,
    OSError: _of_the_system,
    HTTPException: _of_http,
}


def install(app: FastAPI) -> None:
    """Answer every error, of labctl and of the framework, with a problem document."""
    for error, handler in HANDLERS.items():
        app.add_exception_handler(error, handler)
