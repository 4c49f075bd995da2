# make run   set up and run the main job        make test       set up and pass the tests
# make lint  ruff and mypy                      make test-fast  without the slow tests
# make test-long  the tests that take minutes each: every field perturbed, measured rigs, soak, a cold first start
# make loop  hide an effect, run, diagnose, believe, run again: runs/loop/loop.html
# make house print the figures of the house: lines, names, lengths, start times
# make docs  build the documentation site, strictly: dist/site/index.html
# make wheel build a wheel into dist/           make clean      remove the environment and what was built
PYTHON ?= python3.11
VENV ?= .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt
SCENARIO ?= scenarios/drill_slope_45.yaml
PYTEST ?= $(BIN)/python -m pytest
PARALLEL := --numprocesses logical --maxprocesses 4 --dist worksteal

.PHONY: run loop test test-fast test-long lint house docs wheel setup clean

run: $(VENV)/.stamp-run
	@$(BIN)/testbed run $(SCENARIO)

loop: $(VENV)/.stamp-run
	@$(BIN)/testbed loop --out runs/loop

test: $(VENV)/.stamp-dev
	@$(PYTEST) -m "not long" $(PARALLEL)

test-fast: $(VENV)/.stamp-dev
	@$(PYTEST) -m "not slow and not long" $(PARALLEL)

test-long: $(VENV)/.stamp-dev
	@$(PYTEST) -m long

lint: $(VENV)/.stamp-dev
	@$(BIN)/ruff format --check --quiet .
	@$(BIN)/ruff check .
	@$(BIN)/mypy

house: $(VENV)/.stamp-dev
	@$(BIN)/python docs/measures.py

docs: $(VENV)/.stamp-docs
	@NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --quiet --strict
	@ls dist/site/index.html

wheel: $(VENV)/.stamp-dev
	@$(BIN)/python -m build --wheel --no-isolation --outdir dist . > /dev/null
	@ls dist/*.whl

setup: $(VENV)/.stamp-dev

# The build tools come from the pinned versions too: no isolated build that fetches its own.
$(VENV)/.stamp-base: pyproject.toml constraints.txt
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV) || \
		{ echo "This needs Python 3.11: make PYTHON=/path/to/python3.11 $(MAKECMDGOALS)" >&2; exit 1; }
	@$(BIN)/python -c 'import sys; sys.exit(sys.version_info[:2] != (3, 11))' || \
		{ echo "$(VENV) is not Python 3.11: make clean, then make PYTHON=/path/to/python3.11 $(MAKECMDGOALS)" >&2; exit 1; }
	@echo "Setting up $(VENV) (once; some minutes on a fresh machine) ..." >&2
	@$(PIP) hatchling editables
	@touch $@

$(VENV)/.stamp-run: $(VENV)/.stamp-base
	@$(PIP) --no-build-isolation --editable .
	@touch $@

$(VENV)/.stamp-dev: $(VENV)/.stamp-base
	@$(PIP) --no-build-isolation --editable '.[dev]'
	@touch $@ $(VENV)/.stamp-run

$(VENV)/.stamp-docs: $(VENV)/.stamp-base
	@$(PIP) --no-build-isolation --editable '.[docs]'
	@touch $@ $(VENV)/.stamp-run

clean:
	@rm -rf $(VENV) dist build .pytest_cache .mypy_cache .ruff_cache .hypothesis
