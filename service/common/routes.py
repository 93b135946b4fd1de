"""Addresses that are treated in their own way."""

from __future__ import annotations

from starlette.types import Scope

PROBES = frozenset({"/healthz", "/readyz", "/metrics"})
"""Asked every few seconds by machines."""

DOCS = ("/docs", "/openapi.json", "/problems/", "/static/")
"""What describes the service, the same for everybody."""


def is_documentation(path: str) -> bool:
    """Whether an address describes the service, or leads to what does."""
    return path == "/" or any(path.startswith(known) if known.endswith("/") else path == known for known in DOCS)


def route_of(scope: Scope) -> str:
    """The template of the route that a request took, "" if none; never made of what the client wrote."""
    route = scope.get("route")
    if route is not None:
        return str(route.path)
    mounted = str(scope.get("root_path", ""))[len(scope.get("app_root_path", "")) :]
    if mounted:
        return mounted + "/{path}"
    return str(scope["path"]) if "endpoint" in scope else ""
