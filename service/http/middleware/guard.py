"""Asks for a key and keeps to the rate limit, before anything else of a request is looked at."""

from __future__ import annotations

from ipaddress import IPv6Address, ip_address, ip_network

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from duocell.service.common.problems import Problem, response
from duocell.service.common.routes import is_documentation
from duocell.service.http.keys import Keyring
from duocell.service.http.rate import Allowance, Buckets
from duocell.service.settings import Access

ALWAYS_OPEN = frozenset({"/healthz", "/readyz"})
"""Orchestrators have no key, and must not be told to come back later."""


WRONG_RATE, WRONG_BURST = 0.5, 20
"""1/s, wrong keys that an address may send, and how many at once before that; more are answered with 429."""


class Guard:
    """Answers 401 without a known key, 429 beyond the limit; with neither keys nor a limit it does nothing.

    Args:
        app: what is guarded.
        settings: what is open, and the limit.
        keyring: keys that are accepted.
    """

    def __init__(self, app: ASGIApp, settings: Access, keyring: Keyring) -> None:
        self._app = app
        self._settings = settings
        self._keyring = keyring
        self._wrong = Buckets(WRONG_RATE, WRONG_BURST)
        self._buckets = Buckets(settings.rate_limit, settings.rate_burst) if settings.rate_limit else None

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """See the class."""
        if scope["type"] != "http" or scope["path"] in ALWAYS_OPEN:
            await self._app(scope, receive, send)
            return
        key = _presented(Headers(scope=scope))
        owner = self._keyring.owner(key) if self._keyring and key else None
        scope["duocell.key"] = owner  # for the log
        scope["duocell.client"] = client = f"key {owner}" if owner else f"address {_address(scope)}"
        if self._buckets is not None:
            allowance = self._buckets.take(client)
            send = _with_limit(send, self._buckets.policy, allowance)
            if not allowance.granted:
                await response(_too_many(allowance), scope["path"])(scope, receive, send)
                return
        if self._keyring and key and owner is None:
            guess = self._wrong.take(_address(scope))
            if not guess.granted:
                await response(_too_many(guess), scope["path"])(scope, receive, send)
                return
        if self._keyring and owner is None and not self._is_open(scope["path"]):
            await response(_unauthorized(key), scope["path"])(scope, receive, send)
            return
        await self._app(scope, receive, send)

    def _is_open(self, path: str) -> bool:
        """Whether an address needs no key."""
        if path == "/metrics":
            return self._settings.public_metrics
        return self._settings.public_docs and is_documentation(path)


def _presented(headers: Headers) -> str:
    """The key that a request comes with, or "". A gateway may need Authorization for itself: then X-API-Key."""
    scheme, _, credentials = headers.get("authorization", "").partition(" ")
    return credentials.strip() if scheme.lower() == "bearer" else headers.get("x-api-key", "").strip()


def _address(scope: Scope) -> str:
    """Who asks, where nobody says so: an IPv4 address, or the /64 network that an IPv6 host may choose from."""
    host = (scope.get("client") or ("",))[0]
    try:
        address = ip_address(host)
    except ValueError:
        return host
    return str(ip_network((address, 64), strict=False)) if isinstance(address, IPv6Address) else host


def _unauthorized(key: str) -> Problem:
    """No key or an unknown one (RFC 6750)."""
    if not key:
        detail = "This service asks for a key. Send it as 'Authorization: Bearer KEY' or 'X-API-Key: KEY'."
        return Problem("unauthorized", detail, headers={"WWW-Authenticate": 'Bearer realm="duocell"'})
    detail = "The key is not known here. Ask the operator for one; the service knows `duocell key new`."
    challenge = 'Bearer realm="duocell", error="invalid_token"'
    return Problem("unauthorized", detail, headers={"WWW-Authenticate": challenge})


def _too_many(allowance: Allowance) -> Problem:
    detail = f"That was one request too many. Try again in {allowance.retry_after} s, and more slowly."
    return Problem("rate-limited", detail, headers={"Retry-After": str(allowance.retry_after)})


def _with_limit(send: Send, policy: str, allowance: Allowance) -> Send:
    """An ASGI channel that tells in every answer how much is left (draft-ietf-httpapi-ratelimit-headers)."""

    async def sending(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            headers["RateLimit-Policy"] = policy
            headers["RateLimit"] = f'"default";r={allowance.remaining};t={allowance.refill}'
        await send(message)

    return sending
