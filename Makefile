# tribowatch: two commands, `make run` and `make test`. Needs Python 3.11+ with its venv module, make and git.
# Everything that is downloaded, compiled or cached stays inside this folder: `make clean` leaves a fresh checkout.

ROOT  := $(patsubst %/,%,$(dir $(abspath $(lastword $(MAKEFILE_LIST)))))
CACHE := $(ROOT)/.cache
VENV  := $(ROOT)/.venv
BIN   := $(VENV)/bin
PY    := $(BIN)/python

export PIP_CACHE_DIR := $(CACHE)/pip
export PIP_DISABLE_PIP_VERSION_CHECK := 1
export NUMBA_CACHE_DIR := $(CACHE)/numba
export XDG_CACHE_HOME := $(CACHE)/xdg/cache
export XDG_DATA_HOME := $(CACHE)/xdg/data
export XDG_STATE_HOME := $(CACHE)/xdg/state
export XDG_CONFIG_HOME := $(CACHE)/xdg/config
export DASK_CONFIG := $(CACHE)/dask
export DASK_TEMPORARY_DIRECTORY := $(CACHE)/dask
export MYPY_CACHE_DIR := $(CACHE)/mypy
export RUFF_CACHE_DIR := $(CACHE)/ruff

# matrices here are small: threads of linear algebra would only wait for each other, in every test process
export OMP_NUM_THREADS ?= 1

# pip asks `rustc` for its version; a rustup without toolchains would leave a folder in HOME
export RUSTUP_HOME ?= $(if $(wildcard $(HOME)/.rustup),$(HOME)/.rustup,$(CACHE)/rustup)

INSTALL = $(PY) -m pip install --quiet --constraint constraints.txt

# short, because Unix sockets in it may have 107 characters at most
PYTEST = $(PY) -m pytest --basetemp=$(CACHE)/t -q

ARGS ?=
PYTEST_ARGS ?=

.DEFAULT_GOAL := help
.PHONY: page-figures picture help setup run test lint docs bench bench-history bench-search bench-can bench-scale faults fuzz audit-zoo paper kill9 kills soak advisories clean coverage blind-starts cramer-rao excitations run-length real-machines blind blind-second blind-foreign cluster next-experiment before-after cannot-see promises axis-years machine-years daemon-years delay confusion robot-joints story alarm-restarts causes diagnosis-course healthy-lives naming once-wrong true-effect watch-scenarios

help:  ## show this list
	@grep -hE '^[a-z0-9-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:[^#]*## */\t/' | expand -t 14

setup: $(VENV)/.ready  ## make the virtual environment, install, compile the kernels; shared first step of run and test

run: $(VENV)/.ready  ## the demo: a simulated axis wears, the daemon notices; ARGS="--until-alert" to stop there
	@$(BIN)/tribowatch demo $(ARGS)

test: $(VENV)/.ready-dev lint  ## all checks: ruff, mypy, import contracts, pytest
	$(PYTEST) --numprocesses=auto --maxprocesses=8 --dist=worksteal $(PYTEST_ARGS)

lint: $(VENV)/.ready-dev  ## ruff, mypy --strict and the import contracts alone
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports --cache-dir $(CACHE)/grimp

docs: $(VENV)/.ready-dev  ## regenerate docs/cli.md, docs/configuration.md and deploy/tribowatch.toml from the code
	$(PY) docs/generate.py

bench: $(VENV)/.ready-dev  ## benchmarks: simulation, search, the whole stream
	$(PYTEST) tests/benchmarks --benchmark-enable --benchmark-only

robot-joints: $(VENV)/.ready-dev  ## the watch on real robot joints and a real cart on which nothing was broken; wants the recordings of TRIBOWATCH_DATA
	$(PY) -m tests.monitor.studies.robot

bench-history: $(VENV)/.ready-dev  ## ten million rows of history: query times, size; ARGS="--axes 2" for less
	$(PY) -m tests.benchmarks.bench_history $(ARGS)

bench-search: $(VENV)/.ready-bench  ## our search against SciPy, CMA-ES, pymoo, PyGAD on 200 problems; ARGS="--first 30000 --peers 40" for fresh ones
	$(PY) -m tests.benchmarks.bench_search $(ARGS)

bench-scale: $(VENV)/.ready-dev  ## 1, 10, 100, 1000 axes at 100 Hz on one daemon: CPU, memory, lag, time to answers and alerts; 12 min
	$(PY) -m tests.benchmarks.bench_scale $(ARGS)

faults: $(VENV)/.ready-dev  ## the fault table: links cut, publishers and routers restarted, clocks stepped; lost = reported; 6 min
	$(PY) -m tests.scenarios.faults $(ARGS)

fuzz: $(VENV)/.ready-dev  ## a million hostile payloads through the daemon's intake; ARGS="20000" for less
	$(PY) -m tests.scenarios.fuzz $(ARGS)

audit-zoo: $(VENV)/.ready-dev  ## mistakes of sign, unit and scale: caught, missed, and false refusals of healthy machines
	$(PY) -m tests.identify.studies.audit_zoo $(ARGS)

bench-can: $(VENV)/.ready-dev  ## CAN frames to Zenoh at 9000/s for 60 s, beside a plain Notifier bridge; ARGS="--seconds 10" for less
	$(PY) -m tests.benchmarks.bench_can $(ARGS)

paper: $(VENV)/.ready-dev  ## the paper's claims, long form
	$(PYTEST) tests/paper -m "slow or not slow"
	$(PY) -m tests.paper.figures
	$(PY) -m tests.paper.search_figures

coverage: $(VENV)/.ready-dev  ## do the 95 % intervals hold? 1000 windows per case; ARGS="--windows 100 --workers 2"
	$(PY) -m tests.identify.studies.coverage $(ARGS)

blind-starts: $(VENV)/.ready-dev  ## identification from nothing: 24 machines x 3 motions x 3 noise levels
	$(PY) -m tests.identify.studies.blind_starts $(ARGS)

cramer-rao: $(VENV)/.ready-dev  ## the least error these recordings allow anybody, and ours
	$(PY) -m tests.identify.studies.cramer_rao $(ARGS)

excitations: $(VENV)/.ready-dev  ## which motion tells which parameter: Table 1 of the paper in numbers
	$(PY) -m tests.identify.studies.excitations $(ARGS)

run-length: $(VENV)/.ready-dev  ## output error over runs of many lengths against the observer
	$(PY) -m tests.identify.studies.run_length $(ARGS)

real-machines: $(VENV)/.ready-dev  ## estimates and diagnoses of real machines; wants the recordings of TRIBOWATCH_DATA
	$(PY) -m tests.identify.studies.real_machines
	$(PY) -m tests.identify.studies.real_diagnoses $(ARGS)

cannot-see: $(VENV)/.ready-dev  ## what a recording can show, by excitation: docs/what-it-cannot-see.md
	$(PY) -m tests.identify.studies.cannot_see $(ARGS)

promises: $(VENV)/.ready-dev  ## is what `detectable` promises named nine times of ten? an hour of one core; ARGS="--machines 4" for less
	$(PY) -m tests.identify.studies.promises $(ARGS)

blind: $(VENV)/.ready-bench  ## the blind study of the diagnosis, rivals too: 600 cases, 2-4 hours of one core; ARGS="--cases 40" for less
	$(PY) -m tests.blind --rivals $(ARGS)

blind-second: $(VENV)/.ready-bench  ## the same study on cases of the second simulator, by an author who never saw this code; ARGS="--cases 40" for less
	$(PY) -m tests.blind --simulator second --rivals $(ARGS)

blind-foreign: $(VENV)/.ready-dev  ## cases of a simulator of your own, made by tests/blind/author.md: ARGS="FOLDER"
	$(PY) -m tests.blind.foreign $(ARGS)

naming: $(VENV)/.ready-dev  ## training cases of the blind study beside fits of the true effects: why a name was missed; ARGS="--cases 0:10"
	$(PY) -m tests.identify.studies.naming $(ARGS)

once-wrong: $(VENV)/.ready-dev  ## training cases that were once answered wrong, all of them: four minutes of one core
	$(PYTEST) tests/identify/test_once_wrong.py -m "slow or not slow" $(PYTEST_ARGS)

true-effect: $(VENV)/.ready-dev  ## our fit of the true effect against one that starts from the truth; ARGS="--count 8"
	$(PY) -m tests.identify.studies.true_effect $(ARGS)

diagnosis-course: $(VENV)/.ready-dev  ## where the time of a diagnosis goes, and how far off its progress bar is; ARGS="--cases 4"
	$(PY) -m tests.identify.studies.diagnosis_course $(ARGS)

cluster: $(VENV)/.ready-dev  ## more than one machine: a Dask cluster with workers and scheduler killed, daemons that take over
	$(PYTEST) tests/monitor/test_cluster.py tests/scenarios/test_takeover.py \
	  tests/scenarios/test_year_on_cluster.py -m "slow or not slow" -s

next-experiment: $(VENV)/.ready-dev  ## does the experiment a diagnosis proposes settle the tie? the true machine runs it; ARGS="--cases 64"
	$(PY) -m tests.identify.studies.next_experiment $(ARGS)

before-after: $(VENV)/.ready-dev  ## commissioning and today: changes seen, and seen where there are none; ARGS="--pairs 90"
	$(PY) -m tests.identify.studies.before_after $(ARGS)

page-figures: $(VENV)/.ready-dev  ## first paint and data size of each view of the page; ARGS="--axes 20 --windows 365"
	$(PY) -m tests.page.measure $(ARGS)

picture: $(VENV)/.ready-dev  ## the screenshot of the README, from a demo that runs for it
	$(PY) -m tests.page.picture $(ARGS)

axis-years: var/studies/pool.npz  ## how often a healthy axis cries wolf: 1000 axis-years, errors from 10 500 real answers; hours; ARGS="--years 50"
	$(PY) -m tests.monitor.studies.axis_years $(ARGS)

machine-years: var/studies/pool.npz  ## the machines of daemon-years without the daemon, hundreds of years from real answers; ARGS="--machines 50 --list"
	$(PY) -m tests.monitor.studies.machine_years $(ARGS)

healthy-lives: var/studies/pool.npz  ## does friction that wanders by a percent over days cry wolf? half-years of the scenario `healthy`; ARGS="--lives 40"
	$(PY) -m tests.monitor.studies.healthy_lives $(ARGS)

causes: var/studies/pool.npz  ## what the watch calls each cause, many axes from real answers; ARGS="--axes 10"
	$(PY) -m tests.monitor.studies.causes $(ARGS)

delay: $(VENV)/.ready-bench var/studies/pool.npz  ## how soon changes are found, beside the optimum, a fixed rule, river and ruptures; ARGS="--axes 20" for less
	$(PY) -m tests.monitor.studies.delay $(ARGS)

confusion: $(VENV)/.ready-dev  ## simulated causes against what the watch calls them; ARGS="--axes 3" for less, "--first 1000" for fresh ones
	$(PY) -m tests.monitor.studies.confusion $(ARGS)

watch-scenarios: $(VENV)/.ready-dev  ## scenarios burst by burst through identification and watch; ARGS="jam bad_sensor" for these
	$(PY) -m tests.monitor.studies.offline $(ARGS)

story: $(VENV)/.ready-dev  ## a rail defect grows, is named by the daemon, promoted, trended, repaired: the real daemon in time-lapse
	$(PY) -m tests.scenarios.story

daemon-years: $(VENV)/.ready-dev  ## 20 healthy machines through a real daemon for a year, with restarts and gaps: what it raised falsely; ARGS="--axes 4 --days 60"
	$(PY) -m tests.scenarios.daemon_years $(ARGS)

alarm-restarts: $(VENV)/.ready-dev  ## alarms in every state over kill -9, SIGTERM and clocks that step, with a real daemon
	$(PYTEST) tests/scenarios/test_alarms_over_restarts.py -m slow -s

kill9: $(VENV)/.ready-dev  ## kill -9 of the daemon at 20 random moments of a replay: nothing acknowledged is lost
	$(PYTEST) tests/scenarios/test_kill9.py -m slow -s

kills: $(VENV)/.ready-dev  ## kill -9 of daemon, workers, publisher (and server): ARGS="--kills 1000 --database postgresql"
	$(PY) -m tests.scenarios.kill9 $(ARGS)

soak: $(VENV)/.ready-dev  ## the time-lapse plant as fast as it goes: memory, handles, lag, disk: ARGS="--minutes 60"
	$(PY) -m tests.scenarios.soak $(ARGS)

advisories: $(VENV)/.made  ## known advisories against the pinned packages, where an index can be reached; its own environment
	@auditor=$(CACHE)/pip-audit; \
	test -x $$auditor/bin/pip-audit || { $(PY) -m venv $$auditor && \
	  timeout 180 $$auditor/bin/python -m pip install --quiet pip-audit 2>/dev/null; } || { \
	  rm -rf $$auditor; echo "advisories: not audited: pip-audit cannot be installed here"; exit 0; }; \
	$$auditor/bin/python deploy/security/advisories.py constraints.txt $$auditor

clean:  ## remove the virtual environment, caches and the demo's state
	rm -rf .venv .cache .mypy_cache .ruff_cache .pytest_cache .hypothesis .benchmarks build *.egg-info var/demo
	find plant identify monitor tests -name __pycache__ -type d -prune -exec rm -rf {} +

# --- stamps: the second `make run` starts at once -------------------------------------------------------------------

# What every study of the watch draws its errors from, made once: about 15 min of one core.
var/studies/pool.npz: | $(VENV)/.ready-dev
	$(PY) -m tests.monitor.studies.pool

# The first python on PATH that is at least 3.11 and can make virtual environments.
$(VENV)/.made:
	@mkdir -p $(CACHE); \
	for p in python3 python3.13 python3.12 python3.11 python3.14; do \
	  command -v $$p >/dev/null 2>&1 || continue; \
	  $$p -c 'import sys; sys.exit(sys.version_info < (3, 11))' >/dev/null 2>&1 || continue; \
	  old=$$p; \
	  $$p -c 'import venv, ensurepip' >/dev/null 2>&1 || continue; \
	  echo "setup 1/3  virtual environment .venv with $$($$p --version)"; \
	  $$p -m venv --clear $(VENV) && touch $@ && exit 0; \
	done; \
	if [ -n "$$old" ]; then \
	  echo "make setup: $$old lacks the venv module; install it (Debian, Ubuntu: apt install python3-venv)" >&2; \
	else \
	  echo "make setup: needs Python 3.11 or newer as python3 (or python3.11 ... python3.14) on PATH; found $$(command -v python3 >/dev/null && python3 --version 2>&1 || echo none)" >&2; \
	fi; exit 1

$(VENV)/.installed: $(VENV)/.made pyproject.toml constraints.txt
	@echo "setup 2/3  packages into .venv (a minute or two, once)"
	@$(INSTALL) --editable .
	@touch $@

# Compiled code lands in .cache/numba; a second run of the warm-up is a second of checking.
$(VENV)/.ready: $(VENV)/.installed
	@echo "setup 3/3  compile the simulation kernels into .cache/numba (once)"
	@$(PY) -m monitor.warm
	@touch $@

$(VENV)/.ready-dev: $(VENV)/.ready
	@echo "setup      tools of the tests into .venv"
	@$(INSTALL) --editable '.[dev]'
	@touch $@

$(VENV)/.ready-bench: $(VENV)/.ready-dev
	@echo "setup      the other searches into .venv, for the bench only"
	@$(INSTALL) --editable '.[bench]'
	@touch $@
