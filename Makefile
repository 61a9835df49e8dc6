# Each stamp in .venv stands for a step that is done; a second run of a target starts at once.
PYTHON ?= python3
# Bytecode is kept, wherever this runs: without it each process of the tests would compile every file again.
unexport PYTHONDONTWRITEBYTECODE
VENV := .venv
OLDEST := .venv-oldest
ifeq ($(OS),Windows_NT)
BIN := $(VENV)/Scripts
else
BIN := $(VENV)/bin
endif
# In a terminal pip shows what it downloads. What is imported is compiled then, which is a small part of it all.
PIP_INSTALL := -m pip --disable-pip-version-check install --no-compile $(if $(MAKE_TERMOUT),,--quiet)
PIP := $(BIN)/python $(PIP_INSTALL)
ADDRESS := --host 127.0.0.1 --port 8080

# The parts of the page that every change is tried on.
CORE_OF_PAGE := $(foreach part,page view tank policy,tests/browser/test_$(part).py)
REST_OF_PAGE := $(filter-out $(CORE_OF_PAGE),$(wildcard tests/browser/test_*.py))
ABREAST := --numprocesses 3 --dist loadfile --no-loadscope-reorder

.PHONY: nightly mutants benches peers licences release try-release run report test test-slow test-page test-busy test-oldest test-pythons resolve lint real borders bench bench-readme fuzz security samples screenshots figures docs newcomer clean

# Installs everything, and serves the page, which opens on a sample scene.
run: $(VENV)/.installed
	@# Compiles what was not or has changed, so that the page need not wait for that.
	@$(BIN)/dockpose estimate tilted
	$(BIN)/dockpose serve $(ADDRESS)

# Installs everything, and runs the quick tests and the core of the page: three minutes on two cores.
test: $(VENV)/.test $(VENV)/.chromium
	@# In the order of folders: by itself xdist leaves the files with few, long tests to the end, for one process.
	$(BIN)/python -m pytest -m "not slow and not extra" $(ABREAST) $(addprefix --ignore=,$(REST_OF_PAGE))

# All that is slow, or the parts of it that PART names, with a table at the end: an hour on two cores.
nightly: $(VENV)/.made
	@$(BIN)/python .ci/nightly.py $(PART)

# The tests that take two seconds or more, and those that need large packages: six minutes.
test-slow: $(VENV)/.extra
	$(BIN)/python -m pytest -m "slow or extra" $(ABREAST) --ignore tests/browser

# Everything that the page does, in a real browser: about nine minutes.
test-page: $(VENV)/.test $(VENV)/.chromium
	$(BIN)/python -m pytest tests/browser

# The quick tests, ten times, beside four processes that hold the cores.
RUNS ?= 10
test-busy: $(VENV)/.test $(VENV)/.chromium
	$(BIN)/python -m tests.bench.busy --runs $(RUNS)

# A fast part of the tests with the oldest version of each dependency.
test-oldest: $(OLDEST)/.test
	$(OLDEST)/bin/python --version
	$(OLDEST)/bin/python -m pytest --numprocesses 2 --dist loadfile \
		--no-loadscope-reorder -p no:cacheprovider -m "not slow and not extra" \
		tests/pipeline tests/app/state tests/app/drawing tests/app/export tests/app/commands \
		--ignore tests/pipeline/paper --ignore tests/app/commands/test_serve.py

# The quick tests but those of the browser under each other Python that pyproject.toml names and that is found here.
test-pythons: $(VENV)/.installed
	$(BIN)/python .ci/pythons.py

# Asks pip whether the oldest and the newest dependencies fit together on each Python that we name.
resolve: $(VENV)/.installed
	$(BIN)/python .ci/resolve.py

lint: $(VENV)/.test $(VENV)/.lint
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	@# Type checkers do not read the editable install's map of folders; links show them the package as it is installed.
	rm -rf $(VENV)/types && mkdir -p $(VENV)/types/dockpose && ln -sfn $(CURDIR)/pipeline/* $(CURDIR)/app $(VENV)/types/dockpose/
	@# Playwright brings the Node.js along in which Pyright runs where the machine has none.
	PATH="$$PATH:$$($(BIN)/python -c 'import playwright; print(*playwright.__path__)')/driver" $(BIN)/pyright

# Scores photographs and pictures by other programs in DATA; fails where what they reach is lost again. Two minutes;
# with QUICK=--quick the part of it that takes one.
DATA ?= ../shared/data
real: $(VENV)/.test
	$(BIN)/python -m tests.bench.real $(DATA) $(QUICK)

# Files of other programs in forms that people complain of, a folder for each in DATA/reports: two minutes.
borders: $(VENV)/.test
	$(BIN)/python -m tests.bench.borders $(DATA)/reports

bench: $(VENV)/.test $(VENV)/.chromium
	$(BIN)/python -m pytest tests/bench -s -o python_files='bench_*.py' -o faulthandler_timeout=0

# The figures of the README and the docs, measured again: a quarter of an hour.
FIGURES := $(foreach part,readme variety speed limits choice,tests/bench/bench_$(part).py)
bench-readme: $(VENV)/.test
	$(BIN)/python -m pytest $(FIGURES) -s -o python_files='bench_*.py' -o faulthandler_timeout=0

# The benches on which README and notes rest: each fails where a figure that is reached is lost. Eleven minutes on two cores.
BENCHES := $(foreach part,built seen follow choice chosen coverage total centres hand truth,tests/bench/bench_$(part).py)
BENCHES += tests/bench/bench_no_dock.py::test_of_an_unknown_number_nothing_is_surely_a_dock_where_there_is_none
benches: $(VENV)/.test
	$(BIN)/python -m pytest $(BENCHES) -s -o python_files='bench_*.py' -o faulthandler_timeout=0

# Other ways of finding a dock, and other thresholds, on the same pictures, into docs/peers.md: five minutes on two cores.
peers: $(VENV)/.extra
	$(BIN)/python -m tests.bench.peers

# A million inputs that nobody would make on purpose; atheris has no wheel for every Python.
fuzz: $(VENV)/.test
	-$(PIP) atheris
	$(BIN)/python -m tests.fuzz --inputs 1000000 --guided 5000

# Attacks a running page over the loopback, and writes what came of it into SECURITY.md: three minutes, on Linux.
security: $(VENV)/.test
	$(BIN)/python -m tests.attack

# Changes the code in 300 places drawn at random, and lists what the quick tests don't tell: half an hour.
MUTANTS ?= --mutants 300
mutants: $(VENV)/.extra
	$(BIN)/python -m tests.bench.mutants $(MUTANTS)

# Renders every scene of sample_images/ again from its YAML.
samples: $(VENV)/.installed
	$(BIN)/python -c "from tests.support.scenes import render_folder; render_folder('sample_images')"

# Makes docs/paper.md and the study's advice that the page's help shows: some ten minutes.
report: $(VENV)/.installed
	rm -rf build/study
	$(BIN)/dockpose reproduce --out build/reproduction
	rm -rf docs/figures/paper && mkdir -p docs/figures/paper
	cd build/reproduction && cp $$(grep -o '](\./[^)]*' paper.md | cut -c5-) $(CURDIR)/docs/figures/paper/
	sed 's|](\./|](figures/paper/|' build/reproduction/paper.md > docs/paper.md
	$(BIN)/dockpose study --scenes 2000 --seed 2016 --out build/study
	cp build/study/advice.html static/study.html

# Takes the pictures of the page that the README shows, and films its approach.
screenshots: $(VENV)/.chromium
	$(BIN)/python -m tests.browser.screenshots
	$(BIN)/python docs/site/approach.py

# Draws the figures of the documentation.
figures: $(VENV)/.installed
	$(BIN)/python docs/site/figures.py

# The documentation, to be read offline: build/docs/index.html.
docs: $(VENV)/.docs
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict --quiet
	@echo "the documentation is in build/docs/index.html"

# From a clone to the pose in a picture of one's own, as the README says, in a fresh environment.
newcomer: $(VENV)/.test
	$(BIN)/python -m pytest tests/bench/bench_newcomer.py -s -o python_files='bench_*.py' -o faulthandler_timeout=0

# The licences of all that is brought along, and their versions for pip-audit.
licences: $(VENV)/.installed
	$(PIP) --editable ".[all]" packaging
	$(BIN)/python .ci/licences.py
	mkdir -p build && $(BIN)/python -m pip freeze --exclude-editable > build/versions.txt

# What is given out, and its checksums.
release: $(VENV)/.installed
	rm -rf build/release
	$(PIP) build twine
	$(BIN)/python -m build --quiet --outdir build/release
	$(BIN)/python -m twine check --strict build/release/*
	cd build/release && sha256sum * > SHA256SUMS

# Installs what is given out into fresh environments, and tries it from another folder.
try-release: release
	$(BIN)/python .ci/try_release.py build/release

clean:
	rm -rf $(VENV) $(OLDEST) .venv-3.* build .pytest_cache .ruff_cache .hypothesis

$(VENV)/.made:
	$(PYTHON) -m venv $(VENV)
	touch $@

$(VENV)/.installed: $(VENV)/.made pyproject.toml
	@echo "installing dockpose and its libraries into $(VENV): 0.8 GB, about a minute"
	$(PIP) --editable .
	@# Compiles the loops over pixels once, so that the first page need not wait for that.
	$(BIN)/dockpose estimate tilted
	touch $@

$(VENV)/.test: $(VENV)/.made pyproject.toml
	@echo "installing dockpose, its libraries and what the tests need into $(VENV): 1 GB, about a minute"
	$(PIP) --editable ".[test]"
	$(BIN)/python -m tests.support.compile_loops
	touch $@ $(VENV)/.installed

# What is large and few tests need. pycalib-simple asks for another build of OpenCV that would overwrite ours; the part
# that we compare with needs none.
$(VENV)/.extra: $(VENV)/.test
	$(PIP) --editable ".[test,extra]"
	$(PIP) --no-deps pycalib-simple==2026.7.22.1
	touch $@

$(OLDEST)/.test: pyproject.toml tests/constraints-oldest.txt
	$(PYTHON) -m venv $(OLDEST)
	$(OLDEST)/bin/python $(PIP_INSTALL) --constraint tests/constraints-oldest.txt --editable ".[test]"
	$(OLDEST)/bin/python -m tests.support.compile_loops
	touch $@

$(VENV)/.docs: $(VENV)/.test
	$(PIP) --editable ".[docs]"
	touch $@

$(VENV)/.lint: $(VENV)/.test
	$(PIP) --editable ".[lint]"
	touch $@

$(VENV)/.chromium: $(VENV)/.test
	$(BIN)/python -m tests.browser.chromium
	touch $@
