# Two commands do everything: `make check` (the main job) and `make test`.
# Both first build .venv from requirements.lock, which pins every package by version and hash.
PYTHON ?= python3
VENV   ?= .venv
BIN     = $(VENV)/bin
STAMP   = $(VENV)/.installed

.PHONY: setup check test lint ci lock clean

setup: $(STAMP)

$(STAMP): requirements.lock pyproject.toml setup.py
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
	  || { echo "nusselt needs Python 3.11 or newer; name one with: make PYTHON=python3.12 $(MAKECMDGOALS)" >&2; exit 2; }
	@rm -rf $(VENV)
	@$(PYTHON) -m venv $(VENV) 2>/dev/null || $(PYTHON) -m virtualenv -q $(VENV) 2>/dev/null || uv venv -q --seed $(VENV) \
	  || { rm -rf $(VENV); echo "no way to make a virtual environment: $(PYTHON) has no venv module (Debian splits it off as python3-venv), and neither virtualenv nor uv is here" >&2; exit 2; }
	$(BIN)/python -m pip install -q --disable-pip-version-check --no-compile --require-hashes -r requirements.lock
	@# The warning left out is one for whoever runs Python beside folders named as the package's: ours are not.
	PYTHONWARNINGS=ignore $(BIN)/python -m pip install -q --disable-pip-version-check --no-deps --no-build-isolation -e .
	@$(BIN)/python -c pass  # the first start finishes the installation of karellen-llvm-core
	@rm -rf $(VENV)/links && mkdir -p $(VENV)/links/nusselt
	@cd $(VENV)/links/nusselt && ln -s "$(CURDIR)"/experiments/nusselt/* "$(CURDIR)"/renderer "$(CURDIR)"/mitsuba_bridge "$(CURDIR)"/experiments .
	@touch $(STAMP)

check: setup
	$(BIN)/nusselt check --classic --out out --json out/results.json

test: setup
	$(BIN)/python -m pytest -n 2 --dist loadfile --no-loadscope-reorder

lint: setup
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

ci: setup  ## what continuous integration runs, here and elsewhere; types beside tests
	$(MAKE) -j 2 lint test

lock:  ## needs uv
	uv pip compile pyproject.toml --extra dev --universal --python-version 3.11 --generate-hashes \
	  --no-emit-index-url --no-emit-find-links --no-header --no-annotate -o requirements.lock

clean:
	rm -rf $(VENV) out build *.egg-info
