# duocell: every target makes the environment it needs. Needs python3 (>= 3.11, with venv) and make, nothing else.
.DEFAULT_GOAL := help
.PHONY: help setup demo test check lint format types floors audit openapi rooms fuzz bench serve lock image clean

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check --quiet
ARGS ?=

# IPOPT gains nothing from threads, and the worker processes would compete for the cores.
export OMP_NUM_THREADS ?= 1

help: ## this list
	@grep -hE '^[a-z]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/^([a-z]+):.*## (.*)/  make \1\t\2/' | expand -t 18

# Two stamps: the packages of the lock file (a minute or two), and the project itself (seconds).
setup: $(VENV)/.project ## make .venv with everything from the lock file (again only if that changed)

$(VENV)/.packages: requirements-dev.lock
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
	  || { echo "duocell needs Python 3.11 or newer: make PYTHON=/path/to/python3.11"; exit 2; }
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV) \
	  || { rm -rf $(VENV); echo "the venv module is missing: on Debian, apt-get install python3-venv"; exit 2; }
	@echo "installing the locked packages into $(VENV) (1.5 GB on disk, a minute or two) ..."
	@$(PIP) install --require-hashes -r requirements-dev.lock
	@$(BIN)/python .ci/link_libgomp.py
	@touch $@

$(VENV)/.project: $(VENV)/.packages pyproject.toml
	@PYTHONWARNINGS=ignore $(PIP) install --no-deps --no-build-isolation --editable .
	@touch $@

demo: setup ## start the server, send an example over HTTP, print the placements, stop the server
	@$(BIN)/python -m duocell.service.cli.demo $(ARGS)

test: setup ## all tests (ARGS="-k posture" for some)
	@$(BIN)/python -m pytest $(ARGS)

check: lint types floors test ## everything a change must pass: ruff, mypy, import directions, tests

lint: setup
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .

format: setup ## let ruff rewrite the sources
	@$(BIN)/ruff check --fix .
	@$(BIN)/ruff format .

types: setup
	@$(BIN)/mypy

floors: setup
	@$(BIN)/lint-imports

audit: setup ## known vulnerabilities of what is locked (ARGS=--strict: fail if they cannot be looked up)
	@$(BIN)/python .ci/audit.py $(ARGS)

openapi: setup ## write docs/openapi.json, from which clients are made
	@$(BIN)/python .ci/write_openapi.py docs/openapi.json

rooms: setup ## draw docs/rooms.svg, the rooms and what they import
	@$(BIN)/python .ci/draw_rooms.py docs/rooms.svg

fuzz: setup ## send a server thousands of requests, good and bad (ARGS=300 for more)
	@$(BIN)/python -m tests.clients.fuzz $(ARGS)

bench: setup ## medians of the timings the project promises
	@$(BIN)/python -m bench $(ARGS)

serve: setup ## run the server in the foreground (ARGS="--port 9000 --workers 4")
	@$(BIN)/duocell serve $(ARGS)

COMPILE = CUSTOM_COMPILE_COMMAND="make lock" $(BIN)/pip-compile --quiet --no-build-isolation --allow-unsafe --strip-extras \
  --generate-hashes --newline lf --no-emit-options --no-emit-index-url --no-emit-trusted-host --no-emit-find-links
lock: setup ## resolve pyproject.toml anew into the two lock files (ARGS="--upgrade" for newer releases)
	@$(COMPILE) $(ARGS) --output-file requirements.lock pyproject.toml
	@$(COMPILE) $(ARGS) --extra dev --constraint requirements.lock --output-file requirements-dev.lock pyproject.toml

image: ## build the container image
	docker build --tag duocell .

clean: ## remove the environment and everything generated
	rm -rf $(VENV) build dist *.egg-info .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
