"""The order in which a request passes the middleware."""

from __future__ import annotations

from fastapi import FastAPI
from fastapi.middleware.cors import CORSMiddleware

from duocell.service.http.keys import Keyring
from duocell.service.http.middleware.framing import Framing
from duocell.service.http.middleware.guard import Guard
from duocell.service.http.middleware.head import Head
from duocell.service.http.middleware.observe import Observe
from duocell.service.http.middleware.security_headers import SecurityHeaders
from duocell.service.http.middleware.unexpected import Unexpected
from duocell.service.settings import Access

ASKED = ["Authorization", "Content-Type", "Idempotency-Key", "If-None-Match", "Last-Event-ID", "Prefer"]
ASKED += ["X-API-Key", "X-Request-ID"]
"""Headers that a page of another origin may send."""

TOLD = ["ETag", "Link", "Location", "Preference-Applied", "RateLimit", "RateLimit-Policy", "Retry-After"]
TOLD += ["WWW-Authenticate", "X-Request-ID"]
"""Headers that such a page may read."""


def install(app: FastAPI, settings: Access, keyring: Keyring) -> None:
    """Put the middleware around an application; what is added last is passed first."""
    app.add_middleware(Head)
    app.add_middleware(Unexpected)
    app.add_middleware(Guard, settings=settings, keyring=keyring)
    if settings.cors_origins:
        app.add_middleware(
            CORSMiddleware,
            allow_origins=settings.cors_origins,
            allow_methods=["GET", "POST", "DELETE"],
            allow_headers=ASKED,
            expose_headers=TOLD,
        )
    app.add_middleware(Framing)
    app.add_middleware(SecurityHeaders)
    app.add_middleware(Observe)
