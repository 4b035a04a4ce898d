# make run     the demonstration plant at http://127.0.0.1:8000; ARGS="--past 42" for six weeks behind it
# make test    lint, and the tests on a real PostgreSQL and in a real browser, in another order each time; ARGS="-k name" for
#              some of them, ARGS="--randomly-seed=N" for the order of an earlier run
# make test-long  what is slow by nature: campaigns of faults, failover, every page in every size, chance with fresh seeds; and the
#              tests of make test with servers that have one connection to the database for all their pages
# make lint    style, types, lengths, templates, and the walls between the rooms
# make bench   the benchmarks; each prints ratios
# make messages  collect what can be translated into frontend/locale/inband.pot
# make wheel   what others install: dist/inband-*.whl, those of inband-bridge, inband-client and inband-simulators, the sources
#              beside them, and the libraries with their hashes: dist/libraries.txt
# make lock    write constraints.txt: versions as they are, hashes of today; ARGS=--upgrade for the newest versions
# make audit   look the libraries up in a database of known vulnerabilities
# make sbom    what is installed, as CycloneDX: dist/inband.cdx.json
# make clean   remove what make has made; no data

SHELL := /bin/sh
.SHELLFLAGS := -eu -c
.DELETE_ON_ERROR:
# Where it is set, each of some hundred processes compiles the whole program again.
unexport PYTHONDONTWRITEBYTECODE
.PHONY: run test test-long lint bench messages wheel lock audit sbom clean

VENV := .venv
BIN := $(VENV)/bin
# To compile all libraries takes as long as to install them; Python compiles those that are used when they are.
PIP := $(BIN)/python -m pip install -qq --no-compile --disable-pip-version-check --no-input --root-user-action ignore
# The first Python that is new enough; `make PYTHON=...` knows better.
PYTHON ?= $(shell for each in python3 python3.14 python3.13 python3.12 python3.11; do \
	$$each -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && { echo $$each; break; }; done)

run: $(VENV)/installed
	@exec $(BIN)/inband demo $(ARGS)

# Lint runs beside the tests; what it finds is printed at once, and fails the run at its end. Once in a clone: what all workers of
# the tests would compile at the same time is compiled before.
test: $(VENV)/browser
	@$(MAKE) -s lint & lint=$$!; tests=0; \
	test -e $(VENV)/prepared.txt \
		|| { $(BIN)/python -m tests.preloaded && $(BIN)/pytest -qq --collect-only; } > $(VENV)/prepared.txt 2>&1 || true; \
	$(BIN)/pytest -n auto --dist worksteal $(ARGS) || tests=$$?; \
	wait $$lint; exit $$tests

test-long: $(VENV)/browser
	@$(BIN)/pytest -n auto --dist worksteal --long $(ARGS)
	@$(BIN)/pytest -n auto --dist worksteal --one-connection $(ARGS)

lint: $(VENV)/installed-dev
	@$(BIN)/ruff check --quiet
	@$(BIN)/ruff format --check --quiet
	@$(BIN)/mypy --no-error-summary & types=$$!; \
	{ $(BIN)/python -m tests.style \
		&& { $(BIN)/djlint --lint --quiet frontend/templates > $(VENV)/djlint.txt || { cat $(VENV)/djlint.txt; false; }; } \
		&& { $(BIN)/lint-imports > $(VENV)/lint-imports.txt || { cat $(VENV)/lint-imports.txt; false; }; }; \
	} || { kill $$types; exit 1; }; \
	wait $$types

bench: $(VENV)/installed-dev $(VENV)/browser
	@for each in cli single batch bodies chart memory spc history replay pages outcome; do $(BIN)/python -m bench.$$each; done

messages: $(VENV)/installed
	@$(BIN)/pybabel -q extract -F pyproject.toml --project Inband -o frontend/locale/inband.pot .

wheel: $(VENV)/installed
	@rm -rf dist
	@$(BIN)/hatchling build
	@for each in client simulators; do (cd app/$$each && $(CURDIR)/$(BIN)/hatchling build -d $(CURDIR)/dist); done
	@cd app/bridge && $(CURDIR)/$(BIN)/hatchling build -t wheel -d $(CURDIR)/dist
	@sed '/^# For extras/,$$d' constraints.txt > dist/libraries.txt
	@sed '/^# For building/,$$d' constraints.txt > dist/libraries-with-extras.txt
	@$(BIN)/python .ci/lock.py --bridge > dist/libraries-of-the-bridge.txt

lock: $(VENV)/installed-tools
	@$(BIN)/python .ci/lock.py $(BIN)/uv $(ARGS)

audit: $(VENV)/installed-tools
	@$(BIN)/python .ci/audit.py

sbom: $(VENV)/installed
	@mkdir -p dist
	@$(BIN)/inband sbom > dist/inband.cdx.json

clean:
	rm -rf $(VENV) dist .mypy_cache .pytest_cache .ruff_cache .import_linter_cache .hypothesis

$(BIN)/python:
	@test -n "$(PYTHON)" || { echo "Inband needs Python 3.11 or newer, and there is none on the PATH. Install one, or say where it is: make PYTHON=/path/to/python3" >&2; exit 1; }
	@$(PYTHON) -c 'import venv, ensurepip' 2>/dev/null || { echo "This Python cannot make virtual environments. On Debian and Ubuntu: apt-get install python3-venv" >&2; exit 1; }
	@echo "Making the Python environment in $(VENV) (once; needs the network) ..." >&2
	@$(PYTHON) -m venv $(VENV)

# Libraries by the sections of constraints.txt, the build backend too: every file that is fetched has one of the hashes there.
# Inband itself comes without libraries and without a network.
INSTALL = $(PIP) --require-hashes -r $(VENV)/wanted.txt && $(PIP) --no-index --no-deps --no-build-isolation -e .

$(VENV)/installed: pyproject.toml constraints.txt | $(BIN)/python
	@{ sed '/^# For extras/,$$d' constraints.txt; sed -n '/^# For building/,/^# For tests/p' constraints.txt; } > $(VENV)/wanted.txt
	@$(INSTALL)
	@touch $@

$(VENV)/installed-dev: pyproject.toml constraints.txt | $(BIN)/python
	@sed '/^# For make lock/,$$d' constraints.txt > $(VENV)/wanted.txt
	@$(INSTALL)
	@touch $(VENV)/installed $@

$(VENV)/installed-tools: $(VENV)/installed-dev
	@$(PIP) --require-hashes -r constraints.txt
	@touch $@

# A browser for the tests: one that is installed, else Debian's where we may install it, else Playwright's own.
$(VENV)/browser: | $(VENV)/installed-dev
	@for each in chromium-headless-shell chromium chromium-browser google-chrome; do \
		if $$each --version > $@ 2>/dev/null; then exit 0; fi; done; \
	echo "Installing Chromium for the tests (once) ..." >&2; \
	if test "$$(id -u)" = 0; then as_root=; else as_root="sudo -n"; fi; \
	if command -v apt-get >/dev/null && $$as_root true 2>/dev/null \
		&& $$as_root apt-get update -qq && $$as_root env DEBIAN_FRONTEND=noninteractive \
			apt-get install -y -qq --no-install-recommends chromium-headless-shell fonts-liberation >/dev/null \
		&& chromium-headless-shell --version > $@ 2>/dev/null; then exit 0; fi; \
	$(BIN)/playwright install chromium && echo "Playwright's own" > $@
