# Two commands for a fresh machine with Python >= 3.10, make and a package index:
#   make walk   walks ten seconds and says where the replay and the report are
#   make test   everything that can fail: style, types, tests
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
# Small matrices: more than one BLAS thread only gets in the way.
export OPENBLAS_NUM_THREADS := 1
# The demonstration writes to the same place every time.
WALK := runs/walking

.PHONY: help install walk test lint types pytest compare clean

help:
	@sed -n '2,3s/^#  *//p' Makefile

install: $(VENV)/installed

$(VENV)/installed: pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 10))' || \
	  { echo "Python >= 3.10 is needed and $(PYTHON) is older; choose another one with make PYTHON=..."; exit 1; }
	@$(PYTHON) -m venv $(VENV) || \
	  { echo "$(PYTHON) cannot make a virtual environment; on Debian and Ubuntu: apt-get install python3-venv"; exit 1; }
	@echo "installing into $(VENV), which takes a minute"
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e ".[test,dev,campaign]"
	@touch $@

walk: install
	$(BIN)/pdhocbf run walking --out $(WALK)

test: lint types pytest

lint: install
	$(BIN)/ruff check .
	$(BIN)/lint-imports --no-cache --no-logo
types: install
	$(BIN)/mypy
pytest: install
	$(BIN)/python -m pytest

# Against an earlier commit: make compare REV=1d95bb6, and to see only half of it, ARGS="--only scenarios".
compare: install
	@test -n "$(REV)" || { echo "say which commit to compare with: make compare REV=..."; exit 1; }
	$(BIN)/python benchmarks/compare.py $(REV) $(ARGS)

clean:
	rm -rf $(VENV) build dist .pytest_cache .mypy_cache .ruff_cache
