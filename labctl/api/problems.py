"""Errors as problem documents (RFC 9457), one `type` per error class."""

from __future__ import annotations

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from starlette.exceptions import HTTPException

from instruments.errors import InstrumentError
from labctl.errors import LabctlError
from procedures.errors import PlanRefused, ProcedureError, StalePrompt

TYPE_PREFIX = "urn:labctl:problem:"


def problem(status: int, slug: str, title: str, detail: str, instance: str) -> JSONResponse:
    """Make a problem document."""
    body = {"type": TYPE_PREFIX + slug, "title": title, "status": status, "detail": detail, "instance": instance}
    return JSONResponse(body, status_code=status, media_type="application/problem+json")


def _title(error: type[Exception]) -> str:
    return (error.__doc__ or error.__name__).split(";")[0].split(".")[0]


def install(app: FastAPI) -> None:
    """Make every error of the house, and of the framework, leave as a problem document."""

    @app.exception_handler(LabctlError)
    def of_the_house(request: Request, error: LabctlError) -> JSONResponse:
        return problem(error.status, error.slug, _title(type(error)), str(error), request.url.path)

    @app.exception_handler(InstrumentError)
    def of_an_instrument(request: Request, error: InstrumentError) -> JSONResponse:
        return problem(502, "instrument", _title(type(error)), str(error), request.url.path)

    @app.exception_handler(ProcedureError)
    def of_a_procedure(request: Request, error: ProcedureError) -> JSONResponse:
        if isinstance(error, StalePrompt):
            return problem(409, "stale-prompt", _title(type(error)), str(error), request.url.path)
        slug = "plan-refused" if isinstance(error, PlanRefused) else "recipe"
        return problem(400, slug, _title(type(error)), str(error), request.url.path)

    @app.exception_handler(RequestValidationError)
    def of_the_request(request: Request, error: RequestValidationError) -> JSONResponse:
        places = "; ".join(f"{'.'.join(str(p) for p in e['loc'])}: {e['msg']}" for e in error.errors())
        return problem(422, "bad-request", "The request does not fit its description", places, request.url.path)

    @app.exception_handler(OverflowError)
    def of_a_number(request: Request, error: OverflowError) -> JSONResponse:
        text = f"a number is larger than anything here can be ({error})"
        return problem(400, "bad-input", "A number is too large", text, request.url.path)

    @app.exception_handler(HTTPException)
    def of_http(request: Request, error: HTTPException) -> JSONResponse:
        return problem(
            error.status_code, f"http-{error.status_code}", str(error.detail), str(error.detail), request.url.path
        )
