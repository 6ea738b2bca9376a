"""An HTTP connection to a labctl service: identity, time-outs, and its refusals as errors."""

from __future__ import annotations

import ssl
from typing import Any, Literal, TypeVar
from urllib.parse import quote, urlencode

import httpx
from pydantic import BaseModel

from instruments.clock import Clock, SystemClock
from labctl.closing import ClosedAtEnd
from labctl.config import KEY_VARIABLE, key, os_user
from labctl.errors import LabctlError, NotCertified, StoreError

#: How long an answer may take, s: a fit or an import is answered when it is done.
TIMEOUT_S = 300.0
#: A service that is busy and does not say until when is asked again after so long, s.
RETRY_AFTER_S = 1.0
#: Header in which a caller without a key names its user.
USER_HEADER = "Labctl-User"

ModelT = TypeVar("ModelT", bound=BaseModel)


class ServiceRefused(LabctlError):
    """The service refused a request; the text is the service's own.

    `status` is the HTTP status, `slug` the last part of the problem document's `type`, such as `not-found`.
    """

    slug = "service-refused"


def _trust(url: str) -> ssl.SSLContext | Literal[True]:
    """Return which authorities to trust: over http none, as reading all their certificates takes 25 ms."""
    return ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT) if url.startswith("http://") else True


class ServiceConnection(ClosedAtEnd):
    """Requests to one service. `api_key` defaults to `$LABCTL_KEY`; without one the user's name is sent.

    `timeout_s` bounds each answer, and for how long a service that is busy is asked again.
    """

    def __init__(
        self,
        url: str,
        api_key: str | None = None,
        *,
        timeout_s: float = TIMEOUT_S,
        transport: httpx.BaseTransport | None = None,
        clock: Clock | None = None,
    ) -> None:
        self.url = url
        self._timeout_s, self._clock = timeout_s, clock or SystemClock()
        sent_key = api_key or key()
        # without a key, the name only says who claims to ask; a service that wants a key does not read it
        identity = {"Authorization": f"Bearer {sent_key}"} if sent_key else {USER_HEADER: quote(os_user())}
        # the service is on this machine or in the laboratory: a proxy is not used and gets no key
        self.http = httpx.Client(
            base_url=url, timeout=timeout_s, headers=identity, trust_env=False, transport=transport, verify=_trust(url)
        )

    def close(self) -> None:
        """Close the connection."""
        self.http.close()

    def request(self, method: str, path: str, **content: Any) -> httpx.Response:
        """Send a request; `content` are keyword arguments of `httpx.Client.request`.

        Raises ServiceRefused when the service refuses it, StoreError when it does not answer.
        """
        try:
            response = self._send(self.http.build_request(method, path, **content))
        except httpx.HTTPError as error:
            raise self.silent(error) from error
        if response.is_error:
            raise refusal(response)
        return response

    def _send(self, request: httpx.Request) -> httpx.Response:
        """Send a request; a service that has no place for it (429) is asked again when it says, for `timeout_s`."""
        end_s = self._clock.now_s() + self._timeout_s
        while True:
            response = self.http.send(request)
            wait_s = _retry_after_s(response)
            if response.status_code != httpx.codes.TOO_MANY_REQUESTS or self._clock.now_s() + wait_s > end_s:
                return response
            self._clock.sleep(wait_s)

    def get(self, path: str, kind: type[ModelT], **query: str | int | float | None) -> ModelT:
        """Return the answer to a GET as a model."""
        return kind.model_validate(json_of(self.request("GET", path, params=_without_none(query))))

    def get_list(self, path: str, kind: type[ModelT]) -> list[ModelT]:
        """Return the answer to a GET of a list as models."""
        return [kind.model_validate(row) for row in json_of(self.request("GET", path))]

    def silent(self, error: httpx.HTTPError) -> StoreError:
        """Return the error of a service that does not answer."""
        return StoreError(
            f"the service at {self.url} does not answer ({error}); check that `labctl serve` runs and that the "
            "address is right"
        )


def _retry_after_s(response: httpx.Response) -> float:
    """Return after how long a service that is busy wants to be asked again, s."""
    value = response.headers.get("retry-after", "")
    return float(value) if value.isascii() and value.isdigit() else RETRY_AFTER_S


def refusal(response: httpx.Response) -> ServiceRefused:
    """Return the error that a service's refusal, a problem document, stands for."""
    body = json_of(response)
    hint = f" (give the key in ${KEY_VARIABLE})" if response.status_code == 401 else ""
    refused = ServiceRefused(body.get("detail", response.text) + hint)
    refused.status = response.status_code
    refused.slug = str(body.get("type", "")).rpartition(":")[2] or ServiceRefused.slug
    refused.exit_status = NotCertified.exit_status if refused.slug == NotCertified.slug else 2
    return refused


def json_of(response: httpx.Response) -> Any:
    """Return the JSON of an answer; an empty object for an empty one. A body that is not JSON becomes its text."""
    if not response.content:
        return {}
    try:
        return response.json()
    except ValueError:
        return {"detail": response.text[:500]}


def _without_none(query: dict[str, str | int | float | None]) -> dict[str, str | int | float]:
    return {name: value for name, value in query.items() if value is not None}


def query_string(**values: str | int | None) -> str:
    """Return a query string; values that are None or empty are left out."""
    parameters = {name: value for name, value in values.items() if value not in (None, "")}
    return f"?{urlencode(parameters)}" if parameters else ""
