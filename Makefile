# tendonrod: everything a newcomer or a developer runs. `make` alone says what there is.
# Needs: make, Python 3.11 to 3.13 with pip or venv, and a package index to install from.

PYTHON ?= python3
ARGS ?=
VENV := .venv
BIN := $(VENV)/bin
PIP_INSTALL = $(BIN)/python -m pip install -qq --disable-pip-version-check -c constraints.txt

SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.ONESHELL:
.SILENT:
.NOTPARALLEL:
.DELETE_ON_ERROR:
.DEFAULT_GOAL := help
.PHONY: help demo test check docs bench web clean

help: ## say what each target does
	echo "tendonrod: make targets"
	sed -nE 's/^([a-z]+):[^#]*## (.*)$$/  make \1\t\2/p' $(firstword $(MAKEFILE_LIST)) | expand -t 16
	echo "A different interpreter: make demo PYTHON=python3.12.   Options for pytest: make test ARGS='-k helix'."

demo: $(VENV)/.runtime ## install if needed, recompute the paper's results and run a trial on the virtual bench, into out/
	echo "Reproducing the paper's simulation results; the first run also compiles the solver."
	$(BIN)/tendonrod reproduce $(ARGS)
	echo "Running one follow-the-leader trial on the virtual bench, recorded and reported."
	rm -rf out/bench
	$(BIN)/tendonrod rig ftl exonav-1 --target 0.7 --gravity=-9.81,0,0 --seed 1 --output out/bench
	echo "Open out/reproduce/index.html and out/bench/index.html in a browser to read the reports."

test: $(VENV)/.dev $(VENV)/.chromium ## install if needed, run the tests
	echo "Running the tests."
	$(BIN)/python -m pytest -n auto --dist loadfile $(ARGS)

check: $(VENV)/.dev $(VENV)/.docs ## lint, formatting and types (changes nothing)
	echo "Checking lint rules (ruff)."
	$(BIN)/ruff check .
	echo "Checking formatting (ruff format)."
	$(BIN)/ruff format --check .
	echo "Checking types (pyright)."
	PYRIGHT_PYTHON_GLOBAL_NODE=0 PYRIGHT_PYTHON_IGNORE_WARNINGS=1 $(BIN)/pyright

docs: $(VENV)/.docs ## build the documentation into docs/_build/html, warnings are errors
	echo "Building the documentation; its examples are run, so this takes a minute."
	rm -rf docs/_build
	MPLBACKEND=Agg $(BIN)/python -m sphinx -W --keep-going -q -b html docs docs/_build/html
	echo "Open docs/_build/html/index.html in a browser to read it."

bench: $(VENV)/.dev ## run the benchmarks, which print machine, versions and ratios
	for script in benchmarks/[!_]*.py; do
		echo "Running $$script."
		$(BIN)/python "$$script"
	done

web: ## rebuild the page of `tendonrod navigate` from web/ (needs npm; only who changes the page does)
	command -v npm >/dev/null || {
		echo "Rebuilding the page needs npm. As an administrator, run: apt-get install npm" >&2
		exit 1
	}
	cd web
	npm install --no-package-lock --no-audit --no-fund --loglevel=error
	npm run --silent build
	echo "Built src/tendonrod/navigate/web: commit it together with web/."

clean: ## remove the virtual environment, caches and everything that make wrote
	rm -rf $(VENV) out docs/_build dist web/node_modules .pytest_cache .ruff_cache .hypothesis
	find src tests examples benchmarks docs -name __pycache__ -type d -prune -exec rm -rf {} +
	echo "Removed $(VENV), out, docs/_build and the caches."

# ---- the environment; each stamp file lies in the environment, so removing $(VENV) starts afresh ----

$(VENV)/.made:
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null || {
		echo "tendonrod needs Python 3.11 to 3.13, but '$(PYTHON)' is $$($(PYTHON) --version 2>/dev/null || echo not there)." \
			"Install a newer one and say: make PYTHON=python3.12" >&2
		exit 1
	}
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info >= (3, 14))' || \
		echo "Note: $$($(PYTHON) --version) is newer than what tendonrod is tested with (3.11 to 3.13)."
	echo "Making a virtual environment in $(VENV)."
	rm -rf $(VENV)
	if $(PYTHON) -c 'import ensurepip, venv' 2>/dev/null; then
		$(PYTHON) -m venv $(VENV)
	elif $(PYTHON) -m pip --version >/dev/null 2>&1; then
		echo "Python's ensurepip is not installed; pip itself puts pip into the environment instead."
		$(PYTHON) -m venv --without-pip $(VENV)
		$(PYTHON) -m pip --python $(BIN)/python install -qq --disable-pip-version-check pip
	elif [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
		echo "Python's venv is not complete; installing Debian's python3-venv package."
		apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq python3-venv >/dev/null
		$(PYTHON) -m venv $(VENV)
	else
		echo "Python has neither ensurepip nor pip, so no environment can be made." \
			"As an administrator, run: apt-get install python3-venv" >&2
		exit 1
	fi
	touch $@

$(VENV)/.runtime: $(VENV)/.made pyproject.toml constraints.txt
	echo "Installing tendonrod and what it needs (a minute or two the first time)."
	$(PIP_INSTALL) -e .
	touch $@

$(VENV)/.dev: $(VENV)/.runtime
	echo "Installing the test and check tools."
	$(PIP_INSTALL) -e '.[dev]'
	touch $@

# The tests drive the page of `tendonrod navigate` in a browser. Without one they are skipped (on CI: fail), and say so.
$(VENV)/.chromium: $(VENV)/.made
	if command -v chromium >/dev/null || command -v chromium-browser >/dev/null || command -v google-chrome >/dev/null; then
		touch $@
	elif [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
		echo "Installing Debian's chromium package, in which the tests drive the page."
		{ apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends chromium >/dev/null; } && \
			touch $@ || echo "Chromium could not be installed, so the tests of the page are left out." >&2
	else
		echo "There is no chromium, so the tests of the page are left out." \
			"As an administrator, run: apt-get install chromium" >&2
	fi

$(VENV)/.docs: $(VENV)/.runtime
	echo "Installing the documentation tools."
	$(PIP_INSTALL) -e '.[docs]'
	touch $@
