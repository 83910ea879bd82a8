# Every target sets up what it needs into .venv/ and reuses it afterwards. `make help` lists them.
PYTHON ?= python3
BIN := .venv/bin
.DEFAULT_GOAL := help
.PHONY: help setup reproduce test test-slow test-long mutants check format bench guard docs lock clean

help: ## list the targets
	@grep -E '^[a-z-]+:.*##' Makefile | sed -E 's/:.*## /\t/' | expand -t 14

setup: .venv/.complete ## make .venv/ from the locked versions, the package editable in it

.venv/.complete: requirements.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "tuckerl needs Python 3.11 or later; '$(PYTHON)' is older. Say which to use: make PYTHON=python3.12 setup" >&2; exit 2; }
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes --requirement requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	@touch $@

reproduce: setup ## run the paper's experiments and write results/paper
	$(BIN)/tuckerl reproduce --overwrite

test: setup ## run the everyday tests
	$(BIN)/python -m pytest -n auto --dist loadgroup

test-slow: setup ## run the tests that take seconds each; CI runs them too
	$(BIN)/python -m pytest -n auto --dist loadgroup -m "slow and not long"

test-long: setup ## run the tests that take minutes: fuzzers in their large form
	$(BIN)/python -m pytest -n auto -m long

mutants: setup ## make small wrong changes, and see whether the tests notice them
	$(BIN)/python -m tests.mutants

check: setup ## formatter, linter and types, as CI does
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy

format: setup ## format the code and fix what the linter can
	$(BIN)/python -m tests.structure.stub
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

bench: setup ## run the benchmarks beside their peers
	$(BIN)/python -m benchmarks

guard: setup ## say which kernels have lost against the same loops in C
	$(BIN)/python -m benchmarks.guard

docs: setup ## build the documentation site into docs/_build
	@test -x $(BIN)/sphinx-build || $(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes \
		--requirement requirements-docs.lock
	$(BIN)/sphinx-build --fail-on-warning --keep-going --quiet docs docs/_build
	@echo "Open docs/_build/index.html"

LOCK = $(BIN)/uv pip compile pyproject.toml --universal --python-version 3.11 --generate-hashes --no-emit-index-url \
	--no-emit-find-links --upgrade --quiet --custom-compile-command "make lock"
lock: setup ## resolve the dependencies anew into the two lock files
	$(BIN)/python -m pip install --quiet uv
	$(LOCK) --group dev --output-file requirements.lock
	$(LOCK) --group dev --group docs --constraint requirements.lock --output-file requirements-docs.lock

clean: ## remove everything that was made here
	rm -rf .venv results docs/_build .mypy_cache .pytest_cache .ruff_cache .hypothesis benchmarks/build
	find src tests benchmarks -name __pycache__ -prune -exec rm -rf {} +
