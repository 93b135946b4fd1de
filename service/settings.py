"""Settings of the service, from environment variables ``DUOCELL_*`` or flags of the command line."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, SecretStr, field_validator
from pydantic_settings import BaseSettings, NoDecode, SettingsConfigDict


def usable_cores() -> int:
    """Cores this process may run on (a container is often given fewer than the machine has)."""
    return len(os.sched_getaffinity(0))


class Limits(BaseSettings):
    """How large a request may be; beyond these a request is refused with advice."""

    model_config = SettingsConfigDict(env_prefix="DUOCELL_", extra="ignore")

    max_body: int = Field(default=8_000_000, gt=0, description="bytes of a request body")
    max_poses: int = Field(default=5000, ge=2, description="poses of a task, of all its jobs together")
    max_arms: int = Field(default=8, ge=1, description="arms of a cell")
    max_coordinate: float = Field(default=1e4, gt=0.0, description="m, size of any coordinate")
    max_angle: float = Field(default=63.0, gt=0.0, description="rad, size of a joint limit or yaw: ten turns")
    max_obstacles: int = Field(default=200, ge=0, description="obstacles of a cell")
    max_shapes: int = Field(default=50, ge=1, description="shapes of the part, and of each tool")
    max_pieces: int = Field(default=1000, ge=1, description="convex pieces that the meshes of a request stand for")
    max_polygons: int = Field(default=50, ge=0, description="forbidden polygons of the floor")
    max_corners: int = Field(default=100, ge=3, description="corners of a polygon")
    max_couplings: int = Field(default=50, ge=0, description="couplings of a cell")
    time_limit: float = Field(default=60.0, gt=0.0, description="s, soft limit of a solve whose request has none")
    max_time_limit: float = Field(default=600.0, gt=0.0, description="s, time_limit")
    max_certificate_time: float = Field(default=600.0, gt=0.0, description="s, certificate.time_limit")
    max_upload: int = Field(default=50_000_000, gt=0, description="bytes of an upload of a robot or a mesh")
    max_uploads: int = Field(default=4, ge=1, description="uploads that are read at the same time, or wait for it")
    max_arriving: int = Field(default=8, ge=1, description="uploads of one key or address that arrive at the same time")
    max_arriving_in_all: int = Field(default=32, ge=1, description="uploads that arrive at the same time")
    max_kept: int = Field(default=1000, ge=1, description="robots, and meshes, that are kept of one key")
    upload_time_limit: float = Field(default=120.0, gt=0.0, description="s that reading an upload may take")
    keep_deleted: float = Field(
        default=86400.0, ge=0.0, description="s that deleted robots and meshes are kept for layouts accepted before"
    )
    max_entries: int = Field(default=1000, ge=1, description="entries of a zip with meshes")
    max_unpacked: int = Field(default=200_000_000, gt=0, description="bytes that a zip with meshes unpacks to")
    max_ratio: int = Field(default=100, ge=1, description="how many times larger an entry of a zip may become")


class Access(BaseSettings):
    """Who may ask, how often, and from which pages. Everything is open as long as no key is given."""

    model_config = SettingsConfigDict(env_prefix="DUOCELL_", extra="ignore")

    api_keys: str = Field(default="", repr=False, description="hash lines of the API keys, separated by blanks")
    api_keys_file: Path | None = Field(default=None, description="file with one hash line of an API key per line")
    public_docs: bool = Field(default=True, description="/docs, /openapi.json and /problems need no key")
    public_metrics: bool = Field(default=False, description="/metrics needs no key")
    shared: bool = Field(default=False, description="every key sees and changes what belongs to any key")
    trusted_proxies: str = Field(
        default="", description="addresses whose X-Forwarded-For is believed, separated by commas; *: everybody's"
    )
    rate_limit: float = Field(default=0.0, ge=0.0, le=1e6, description="1/s, requests per key or address; 0: no limit")
    rate_burst: int = Field(default=20, ge=1, le=10**6, description="requests that may come at once before that")
    cors_origins: Annotated[tuple[str, ...], NoDecode] = Field(
        default=(), description="origins whose pages may ask, separated by commas; *: all"
    )

    @field_validator("cors_origins", mode="before")
    @classmethod
    def _split(cls, value: object) -> object:
        """An environment variable holds one text."""
        return tuple(part.strip() for part in value.split(",") if part.strip()) if isinstance(value, str) else value

    @field_validator("cors_origins")
    @classmethod
    def _look_like_origins(cls, value: tuple[str, ...]) -> tuple[str, ...]:
        """Browsers send scheme, host and port, and nothing behind it; anything else would silently never match."""
        for origin in value:
            if origin != "*" and not re.fullmatch(r"https?://[^/\s@?#]+", origin):
                raise ValueError(f"{origin!r} is no origin; write https://host or http://host:port, or *")
        return value


class Logging(BaseSettings):
    """What is written to stderr, and how."""

    model_config = SettingsConfigDict(env_prefix="DUOCELL_", extra="ignore")

    log_level: Literal["debug", "info", "warning", "error"] = Field(
        default="info", description="least level that is logged; debug adds the probes of health and metrics"
    )
    log_format: Literal["auto", "json", "console"] = Field(
        default="auto", description="json: one object a line; console: for people; auto: console on a terminal"
    )


class Settings(Limits, Access, Logging):
    """Everything that can be set from outside.

    A time limit is soft: the optimizer returns the best point so far. A solve that has not answered ``grace`` seconds
    after every soft limit has passed is told to stop, and its worker is killed if it does not.
    """

    host: str = Field(default="127.0.0.1", description="address to listen on")
    port: int = Field(default=8000, ge=0, le=65535, description="port to listen on; 0 takes a free one")
    workers: int = Field(default_factory=usable_cores, ge=1, le=256, description="solves at the same time")
    data_dir: Path = Field(default=Path("data"), description="folder for what has to survive a restart")
    database_url: SecretStr | None = Field(
        default=None, description="PostgreSQL, postgresql://user:password@host/name; left out: SQLite in the data_dir"
    )
    accept_limit: float = Field(default=10.0, gt=0.0, description="s that reading and checking a request may take")
    evaluate_limit: float = Field(default=20.0, gt=0.0, description="s before an evaluation is given up")
    max_evaluations: int = Field(default=16, ge=1, description="evaluations at the same time, waiting ones included")
    grace: float = Field(default=1.0, gt=0.0, description="s beyond the soft limits before a solve is stopped")
    max_attempts: int = Field(default=5, ge=1, le=100, description="times a job is tried whose worker or server dies")
    drain: float = Field(default=5.0, ge=0.0, description="s that running solves are given when the service is stopped")
    max_queued: int = Field(default=64, ge=0, description="jobs of one client that may wait for a worker")
    max_queued_in_all: int = Field(default=1000, ge=0, description="jobs of all clients that may wait for a worker")
    max_wait: float = Field(default=60.0, ge=0.0, description="s, cap of Prefer: wait")
    max_follow: float = Field(default=600.0, gt=0.0, description="s after which a stream of events ends; it can resume")
    keep_jobs: int = Field(default=1000, ge=1, description="finished jobs that are remembered")
    self_test_every: float = Field(default=10.0, gt=0.0, le=25.0, description="s between self-tests")

    @field_validator("database_url")
    @classmethod
    def _known_database(cls, value: SecretStr | None) -> SecretStr | None:
        """Refuse what cannot be a database before anything is started."""
        if value is not None and value.get_secret_value():
            from duocell.service.common.database_url import checked_url

            return SecretStr(checked_url(value.get_secret_value()))
        return None

    def store_url(self) -> str:
        """Of the database that keeps the jobs; holds the password."""
        from duocell.service.common.database_url import sqlite_url

        return sqlite_url(self.data_dir) if self.database_url is None else self.database_url.get_secret_value()
