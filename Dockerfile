# The service in a container: two stages, so that only what runs is shipped.
#   docker build --tag duocell .
#   docker run --rm --publish 8000:8000 duocell

FROM python:3.11-slim-bookworm AS build
# libgomp1: Pinocchio's wheel needs it. binutils: `strip` for the debug symbols some wheels carry.
RUN apt-get update -qq && apt-get install -y -qq --no-install-recommends binutils libgomp1 >/dev/null
RUN python -m venv /opt/duocell
WORKDIR /source
COPY requirements.lock requirements-dev.lock ./
RUN /opt/duocell/bin/pip install --quiet --no-cache-dir --require-hashes --requirement requirements.lock
# The locked build backend, outside the environment that is shipped.
RUN python -m venv /opt/backend \
    && sed -n '/^setuptools==/,/^    #/p' requirements-dev.lock > /opt/backend/setuptools.lock \
    && /opt/backend/bin/pip install --quiet --no-cache-dir --require-hashes --requirement /opt/backend/setuptools.lock
COPY pyproject.toml README.md LICENSE NOTICE ./
COPY models models
COPY optimizer optimizer
COPY service service
COPY src src
RUN /opt/backend/bin/pip wheel --quiet --no-deps --no-build-isolation --wheel-dir /opt/backend . \
    && /opt/duocell/bin/pip install --quiet --no-deps /opt/backend/duocell-*.whl
COPY .ci/trim_site_packages.py /opt/backend/
RUN /opt/duocell/bin/pip uninstall --quiet --yes setuptools pip \
    && python /opt/backend/trim_site_packages.py /opt/duocell/lib/python3.11/site-packages

FROM python:3.11-slim-bookworm
RUN apt-get update -qq && apt-get install -y -qq --no-install-recommends libgomp1 >/dev/null \
    && rm -rf /var/lib/apt/lists/*
COPY LICENSE NOTICE /usr/share/doc/duocell/
COPY examples /usr/share/doc/duocell/examples
RUN useradd --uid 10001 --shell /usr/sbin/nologin --create-home --home-dir /var/lib/duocell duocell
COPY --from=build /opt/duocell /opt/duocell
# One thread per process: IPOPT gains nothing from more, and the workers would compete for the cores.
ENV PATH=/opt/duocell/bin:$PATH \
    OMP_NUM_THREADS=1 \
    PYTHONUNBUFFERED=1 \
    MPLCONFIGDIR=/tmp/matplotlib \
    DUOCELL_DATA_DIR=/var/lib/duocell \
    DUOCELL_PORT=8000
USER duocell
WORKDIR /var/lib/duocell
EXPOSE 8000
STOPSIGNAL SIGTERM
HEALTHCHECK --interval=30s --timeout=5s --start-period=10s --retries=3 \
    CMD ["python", "-c", "import os, urllib.request as r; r.urlopen(f'http://127.0.0.1:{os.environ[\"DUOCELL_PORT\"]}/healthz', timeout=4)"]
ENTRYPOINT ["duocell"]
CMD ["serve", "--host", "0.0.0.0"]
