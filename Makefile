# The two commands of a newcomer: `make demo` and `make test`. Both set everything up themselves.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
# The modules are compiled once, not by each of the some hundred processes that the tests and the demo start.
unexport PYTHONDONTWRITEBYTECODE
PIP := $(BIN)/python -m pip --disable-pip-version-check --quiet

.PHONY: install demo test test-slow mutants lint types generated docs bench study attack lock clean

install: $(VENV)/.installed
demo: install
	@$(BIN)/labctl demo

# Tests begin many threads, each of which would keep memory of its own.
test test-slow: export MALLOC_ARENA_MAX = 2

test: $(VENV)/.tested
	@scripts/install-test-dependencies
	@$(BIN)/python -m pytest -n auto --dist loadfile --no-loadscope-reorder -m "not slow"

# The tests that take long: searches, coverage over many draws, campaigns, pages. `.ci/run` runs them after `make test`.
test-slow: $(VENV)/.tested
	@scripts/install-test-dependencies
	@$(BIN)/python -m pytest -n 3 --dist loadfile --no-loadscope-reorder -m slow

lint: $(VENV)/.tested
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/basedpyright --pythonpath $(BIN)/python
	$(BIN)/lint-imports
	@scripts/install-page-tools
	@scripts/check-pages

# The types of the pages, from the OpenAPI document of this labctl; kept in the repository, and a test holds them to it.
types: $(VENV)/.tested
	@scripts/install-page-tools
	@$(BIN)/python scripts/openapi-document >node_modules/.openapi.json
	@npm run --silent types -- node_modules/.openapi.json

# All files that are made from the code and kept in the repository; tests hold each of them to it.
generated: types
	@$(BIN)/python -m tests.helpers.public_api
	@$(BIN)/python -m typer labctl.cli.app utils docs --name labctl --output docs/reference/command-line.md
	@$(BIN)/python scripts/effects-page

# The documentation as a site in docs/_build, every warning an error: links, anchors, pictures and docstrings are checked.
docs: $(VENV)/.documented
	$(BIN)/python -m sphinx --builder html --fresh-env --fail-on-warning --keep-going --quiet docs docs/_build
	@echo "docs/_build/index.html"

bench: $(VENV)/.tested
	@$(BIN)/python -m benchmarks

study: $(VENV)/.studied
	@OPENBLAS_NUM_THREADS=1 $(BIN)/python -m studies

# Small changes of the modules that keep a bench safe, each of which a test has to notice (hours; MODULES="guards limits").
mutants: $(VENV)/.mutated
	@OPENBLAS_NUM_THREADS=1 $(BIN)/python -m mutants $(MODULES)

# Every attack that labctl is to withstand, against services on loopback, and what an abort takes meanwhile.
attack: $(VENV)/.tested
	@$(BIN)/python -m pytest -q tests/system/test_connection_attacks.py tests/system/test_service_faults.py tests/labctl/api/test_hostile_requests.py
	@LABCTL_STUDY_ABORTS=$${LABCTL_STUDY_ABORTS:-5} $(BIN)/python -m studies attacks

$(VENV)/bin/python:
	@scripts/make-venv "$(PYTHON)" "$(VENV)"

$(VENV)/.installed: requirements/run.txt pyproject.toml | $(VENV)/bin/python
	$(PIP) install --require-hashes -r requirements/run.txt
	$(PIP) install --no-deps --no-build-isolation -e .
	@touch $@

$(VENV)/.tested: requirements/dev.txt $(VENV)/.installed
	$(PIP) install --require-hashes -r requirements/dev.txt
	@touch $@

$(VENV)/.studied: requirements/study.txt $(VENV)/.installed
	$(PIP) install --require-hashes -r requirements/study.txt
	@touch $@

$(VENV)/.mutated: requirements/mutants.txt $(VENV)/.tested
	$(PIP) install --require-hashes -r requirements/mutants.txt
	@touch $@

$(VENV)/.documented: requirements/docs.txt $(VENV)/.installed
	$(PIP) install --require-hashes -r requirements/docs.txt
	@touch $@

# Versions move only here. The lock files carry hashes and no registry address.
lock:
	uv pip compile pyproject.toml --extra lab --extra build --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-header --quiet -o requirements/run.txt
	uv pip compile pyproject.toml --extra lab --extra build --extra dev --extra docs --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-header --quiet -c requirements/run.txt -o requirements/dev.txt
	uv pip compile pyproject.toml --extra lab --extra build --extra study --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-header --quiet -c requirements/run.txt -o requirements/study.txt
	uv pip compile pyproject.toml --extra lab --extra build --extra docs --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-header --quiet -c requirements/run.txt -o requirements/docs.txt
	uv pip compile pyproject.toml --extra lab --extra build --extra dev --extra mutants --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-header --quiet -c requirements/dev.txt -o requirements/mutants.txt

clean:
	rm -rf docs/_build $(VENV) node_modules .mypy_cache .ruff_cache .pytest_cache .import_linter_cache
