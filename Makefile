# Everything a developer runs. Needs Python 3.11 or newer and make; on Debian and Ubuntu it installs the
# system libraries of Qt and VTK where that takes no password, and names the exact command where it does.

.DEFAULT_GOAL := help
.PHONY: help demo test test-train lint style types tests format docs clean

is_usable = $(1) -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null
PYTHON ?= $(shell for p in python3 python3.13 python3.12 python3.11; do \
	$(call is_usable,$$p) && echo $$p && break; done)

VENV := .venv
BIN := $(VENV)/bin
PY := $(BIN)/python

# The tests start some hundred processes: compiling every module anew in each would take minutes.
unexport PYTHONDONTWRITEBYTECODE

# A comma would end the argument of a call.
comma := ,

# $(call set_up,EXTRAS) keeps a sound environment, and installs only when pyproject.toml is newer than the
# last installation. Plain recipes instead of file targets, because make looks at a target's age too early to
# notice that its environment has just been made anew.
define set_up
@$(call is_usable,$(PY)) && $(PY) -c 'import pip' 2>/dev/null || { \
	[ -n "$(PYTHON)" ] || { echo "Python 3.11 or newer is needed: make PYTHON=/path/to/python3 …" >&2; exit 1; }; \
	$(PYTHON) .ci/system_packages.py venv && \
	echo "Making the environment $(VENV) with $$($(PYTHON) --version)" && \
	$(PYTHON) -m venv --clear $(VENV); }
@[ $(VENV)/installed$(1) -nt pyproject.toml ] || { \
	echo "Installing the program into $(VENV) (some minutes and 1.5 GB the first time)" && \
	$(PY) -m pip --disable-pip-version-check install --quiet --editable '.$(1)' && \
	touch '$(VENV)/installed$(1)'; }
endef

help:  ## show this list
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/make \1\t\2/p' $(MAKEFILE_LIST) | expand -t 18

demo:  ## set everything up, then open the application on the demo study
	$(call set_up,)
	@$(PY) .ci/system_packages.py window
	@$(PY) -m annotator demo

test:  ## set everything up, then pass all checks and tests
	@$(MAKE) --no-print-directory --jobs=2 types tests

test-train:  ## install what trains networks as well, then pass the tests that need it
	$(call set_up,[test$(comma)train])
	@echo "Tests of training"
	@launcher=$$($(PY) .ci/system_packages.py offscreen) && $$launcher $(PY) -m pytest -q -n auto -m torch

lint: style types  ## style, types, and the direction of imports

style:
	$(call set_up,[test])
	@echo "Style"
	@$(PY) -m ruff check --quiet .
	@$(PY) -m ruff format --check --quiet . || { echo "Not formatted: 'make format' does it." >&2; exit 1; }
	@echo "Imports"
	@$(PY) -c 'from importlinter.cli import lint_imports_command as main; main()' --no-logo

# It takes a minute on one core: `make test` lets the tests begin meanwhile.
types: style
	@echo "Types"
	@$(PY) -m mypy --no-error-summary

tests: style
	@$(PY) -c 'import torch' 2>/dev/null && echo "Tests" || \
		echo "Tests, without those that need torch: 'make test-train' installs it and passes them"
	@launcher=$$($(PY) .ci/system_packages.py offscreen) && $$launcher $(PY) -m pytest -q -n auto

format:  ## rewrite the code in the project's style
	$(call set_up,[test])
	@$(PY) -m ruff check --fix-only --quiet .
	@$(PY) -m ruff format .

docs:  ## rewrite the pages that are made from the code
	$(call set_up,[test])
	@$(PY) -m annotator.actions.table > docs/shortcuts.md

clean:  ## remove the environment and every cache
	rm -rf $(VENV) build dist .hypothesis .import_linter_cache .mypy_cache .pytest_cache .ruff_cache
	find annotations annotator tests -name __pycache__ -type d -prune -exec rm -rf {} +
