# Set-up happens by itself: a virtual environment in .venv with the package built into it.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
SOURCES := $(shell find crates python -name '*.rs' -o -name 'Cargo.toml') Cargo.toml Cargo.lock pyproject.toml

.DEFAULT_GOAL := help
.PHONY: help demo test test-long portable test-extras test-browser lint format reproduce docs wheel bench clean prerequisites

help: ## This list
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*## /\t/' | expand -t 14

demo: $(READY) ## Grasps for a real bottle: table, JSON and picture in out/
	@mkdir -p out
	@$(BIN)/graspmoduli grasp examples/objects/yogurt_bottle.ply \
	    --json out/yogurt_bottle.json --picture out/yogurt_bottle.png

test: $(READY) ## Every test that is quick, Rust and Python
	cargo test --release --quiet --package graspmoduli --features objects
	$(BIN)/pytest --numprocesses auto --ignore tests/extras --ignore tests/browser \
	    --ignore python/graspmoduli/torch.py --ignore python/graspmoduli/jax.py \
	    --ignore python/graspmoduli/viewing/browser -m 'not long' python tests

test-long: $(READY) ## The tests that take longer: whole runs, killed runs, damaged files
	$(BIN)/pytest --numprocesses auto --ignore tests/extras --ignore tests/browser -m long tests
	$(BIN)/python tests/long_fuzz.py 3000

test-extras: $(READY) ## The tests of torch, jax and dask: installs them, several gigabytes
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --retries 10 \
	    --editable '.[torch,jax,dask]'
	$(BIN)/pytest tests/extras

test-browser: $(READY) ## The viewer in a real browser: installs viser, Playwright and, if root, chromium
	@command -v chromium >/dev/null || { test "$$(id -u)" = 0 && command -v apt-get >/dev/null && \
	    apt-get update -qq && apt-get install -y -qq chromium >/dev/null; } || \
	    { echo "the browser tests need chromium: install it (Debian: apt install chromium)"; exit 1; }
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --retries 10 \
	    --editable '.[view]' 'playwright>=1.50' 'axe-playwright-python>=0.1'
	$(BIN)/pytest tests/browser

wheel: $(READY) ## A wheel for this platform in out/wheels/, tried in an empty environment
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --retries 10 'maturin>=1.16,<2'
	rm -rf out/wheels
	$(BIN)/maturin build --release --quiet --out out/wheels
	$(BIN)/python tests/wheel.py out/wheels

portable: $(READY) ## The same answers under every instruction set of this machine
	$(BIN)/python tests/portable/check.py

lint: $(READY) ## Formatting, clippy, ruff, types and the stubs of the binding
	cargo fmt --check
	cargo clippy --release --all-targets --quiet --features graspmoduli/objects -- --deny warnings
	cargo clippy --release --quiet --package graspmoduli --no-default-features -- --deny warnings
	RUSTDOCFLAGS='--deny warnings' cargo doc --quiet --no-deps --package graspmoduli --features objects
	cargo package --quiet --package graspmoduli --allow-dirty --no-verify
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/pyright
	$(BIN)/stubtest --allowlist crates/graspmoduli-python/stubtest-allowlist.txt graspmoduli._core

format: $(READY) ## Format the sources
	cargo fmt
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

reproduce: $(READY) ## The paper's experiments at the quick scale: report in out/reproduction/
	$(BIN)/graspmoduli reproduce --out out/reproduction

docs: $(READY) ## The documentation site, without a network, in out/site/
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --retries 10 \
	    'mkdocs-material>=9.6' 'mkdocstrings[python]>=0.29' 'latex2mathml>=3.77'
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet

bench: $(READY) ## Speed, side by side with SciPy in one run
	$(BIN)/python benchmarks/bench.py --markdown docs/benchmarks.md

clean: ## Remove what was built
	rm -rf $(VENV) target out

# The virtual environment is made anew by hand only: make clean.
$(READY): $(SOURCES) | prerequisites
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV) || \
	    { echo "graspmoduli needs Python's venv module: install it (Debian: apt install python3-venv)"; exit 1; }
	@echo "building and installing into $(VENV) (about a minute the first time)"
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[dev]'
	@touch $(READY)

prerequisites:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 10))' 2>/dev/null || \
	    { echo "graspmoduli needs Python 3.10 or newer: install it from python.org, or name one with make PYTHON=..."; exit 1; }
	@command -v cargo >/dev/null || \
	    { echo "graspmoduli needs Rust to build: install it from https://rustup.rs"; exit 1; }
	@command -v cc >/dev/null || \
	    { echo "graspmoduli needs a C linker to build: install one (Debian: apt install gcc)"; exit 1; }
