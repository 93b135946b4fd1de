"""/docs and /metrics: pages for people and for Prometheus; no part of the published interface."""

from __future__ import annotations

import base64
import hashlib
import re
from http import HTTPStatus

from fastapi import APIRouter
from fastapi.openapi.docs import get_swagger_ui_html
from fastapi.responses import HTMLResponse, RedirectResponse, Response

from duocell.service.observability import metrics

router = APIRouter(include_in_schema=False)

NO_ICON = "data:,"
"""An icon that is no request."""

_PAGE = bytes(
    get_swagger_ui_html(
        openapi_url="/openapi.json",
        title="duocell",
        swagger_js_url="/static/swagger-ui/swagger-ui-bundle.js",
        swagger_css_url="/static/swagger-ui/swagger-ui.css",
        swagger_favicon_url=NO_ICON,
    ).body
)


def _policy(page: bytes) -> str:
    """What the page may load: files of this service, and its own inline scripts, named by their hashes."""
    scripts = re.findall(rb"<script>(.*?)</script>", page, re.DOTALL)
    hashes = " ".join(f"'sha256-{base64.b64encode(hashlib.sha256(text).digest()).decode()}'" for text in scripts)
    return (
        f"default-src 'none'; script-src 'self' {hashes}; style-src 'self' 'unsafe-inline'; img-src 'self' data:; "
        "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    )


_HEADERS = {"Content-Security-Policy": _policy(_PAGE)}


@router.get("/")
async def get_root() -> RedirectResponse:
    """Who comes to the address of the service without any idea sees what it does."""
    return RedirectResponse("/docs", HTTPStatus.SEE_OTHER)


@router.get("/docs")
async def get_docs() -> HTMLResponse:
    """Forms for every request; everything they load comes from here."""
    return HTMLResponse(_PAGE, headers=_HEADERS)


@router.get("/metrics")
async def get_metrics() -> Response:
    """Numbers for Prometheus."""
    return Response(metrics.exposition(), media_type=metrics.MEDIA_TYPE)
