"""One server for all pages."""

from collections.abc import Iterator

import pytest

from duocell.service.cli.demo import serving


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Address of a server of our own."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("DUOCELL_WORKERS", "1")
        with serving(tmp_path_factory.mktemp("server") / "log") as url:
            yield url
