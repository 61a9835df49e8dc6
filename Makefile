# Each stamp in .venv stands for a step that is done; a second run of a target starts at once.
PYTHON ?= python3
VENV := .venv
ifeq ($(OS),Windows_NT)
BIN := $(VENV)/Scripts
else
BIN := $(VENV)/bin
endif
PIP := $(BIN)/python -m pip --disable-pip-version-check install --quiet
ADDRESS := --host 127.0.0.1 --port 8080

.PHONY: run test lint bench samples screenshots clean

run: $(VENV)/.installed
	$(BIN)/dockpose serve $(ADDRESS)

test: $(VENV)/.test $(VENV)/.chromium
	$(BIN)/python -m pytest --ignore tests/browser --numprocesses 2 --dist loadfile
	@# One after the other: a browser without a graphics card takes all cores for itself.
	$(BIN)/python -m pytest tests/browser

lint: $(VENV)/.test $(VENV)/.lint
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	@# Type checkers do not read the editable install's map of folders; links show them the package as it is installed.
	mkdir -p $(VENV)/types/dockpose && ln -sfn $(CURDIR)/pipeline/* $(CURDIR)/app $(VENV)/types/dockpose/
	$(BIN)/pyright

bench: $(VENV)/.test $(VENV)/.chromium
	$(BIN)/python -m pytest tests/bench -s -o python_files='bench_*.py'

# Renders every scene of sample_images/ again from its YAML.
samples: $(VENV)/.installed
	$(BIN)/python -m dockpose.simulate sample_images

# Takes the pictures of the page that the README shows.
screenshots: $(VENV)/.chromium
	$(BIN)/python -m tests.browser.screenshots

clean:
	rm -rf $(VENV) .pytest_cache .ruff_cache .hypothesis

$(VENV)/.made:
	$(PYTHON) -m venv $(VENV)
	touch $@

$(VENV)/.installed: $(VENV)/.made pyproject.toml
	$(PIP) --editable .
	@# Compiles the loops over pixels once, so that the first page need not wait for that.
	$(BIN)/dockpose estimate sample_images/plain.png
	touch $@

# pycalib-simple asks for another build of OpenCV that would overwrite ours; the part that we compare with needs none.
$(VENV)/.test: $(VENV)/.installed
	$(PIP) --editable ".[test]"
	$(PIP) --no-deps pycalib-simple==2026.7.22.1
	touch $@

$(VENV)/.lint: $(VENV)/.installed
	$(PIP) --editable ".[lint]"
	touch $@

$(VENV)/.chromium: $(VENV)/.test
	$(BIN)/python -m tests.browser.chromium
	touch $@
