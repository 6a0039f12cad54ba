# Each target makes the environment that it needs. Stamp files remember what was installed, so a second run of a
# target installs nothing; `make PYTHON=python3.12 …` chooses the interpreter of a new environment.
PYTHON ?= python3
VENV := .venv
DEVKIT := .venv-devkit
METADATA := setup.cfg pyproject.toml
# Whatever is imported is compiled then; to compile all of torch takes minutes.
PIP_FLAGS := --quiet --disable-pip-version-check --no-compile
# Tests run on all cores; those of a file stay together, since they share what takes long to make.
SPREAD := -n auto --dist loadfile
# What depends on the releases of numpy, OpenCV and shapely, which are older beside the devkit; no torch is there.
EXACT := $(addprefix tests/,geometry raster homography footprints metrics test_grid.py test_frames.py \
	test_targets.py test_trajectories.py) --deselect=tests/footprints/test_flat_world.py \
	--deselect=tests/raster/test_drivable.py::test_random_poses_on_the_real_masks_follow_the_devkit_s_rule

.DEFAULT_GOAL := help
.PHONY: help install demo test slow pictures site release-check harden mutants conformance conformance-env environments bench \
	bench-learn bench-plan bench-tables bench-real bench-scale demo-start

help:
	@echo "make install      $(VENV) with the ogmkit command and what training needs"
	@echo "make demo         the whole chain on fixtures/: shards, trainings, both tables and pictures, under demo/"
	@echo "make test         linters, types, import contract and tests"
	@echo "make slow         the long tests: four frames, four sequences learnt by heart, kills, masks of real size"
	@echo "make pictures     the pictures of README.md and docs/ that need no training"
	@echo "make site         the pages as a site, under site/, with the help of every command and the public names"
	@echo "make release-check  wheel and sdist in new environments of every Python here, at the oldest releases too; 20 minutes"
	@echo "make harden       faults, kills and broken inputs for every command, 90 minutes at a time; resumes"
	@echo "make mutants      change the exact modules one place at a time: do their own tests notice? half an hour"
	@echo "make conformance  ogmkit beside the official nuScenes devkit, in $(DEVKIT)"
	@echo "make bench        the figures of docs/performance.md, measured side by side"
	@echo "make bench-learn  every stage-1 system trained on synthetic worlds, in parts; takes hours (LEARN=--plan: shows them)"
	@echo "make bench-plan   every planner likewise (PLAN=--plan)"
	@echo "make bench-tables what these two have found so far, into benchmarks/RESULTS.md"
	@echo "make bench-scale  the whole of trainval, generated, on this machine: times, memory, ratios; hours (SCALE=--plan)"
	@echo "make bench-real   networks on real images, each scene left out once; takes hours (REAL=--quick: less)"

define new_environment
@$(PYTHON) -c 'import sys; sys.exit(None if sys.version_info >= (3, 11) else "ogmkit needs Python 3.11 or newer, \
	and $(PYTHON) is " + sys.version.split()[0] + ": try make PYTHON=python3.12 $(MAKECMDGOALS)")'
@test -x $(1)/bin/python || $(PYTHON) -m venv $(1)
endef

# On all cores; pip does it on one. Uncompiled, torch and lightning cost each command seconds more wherever Python is
# told not to write bytecode. Packages hold some files that are no Python: that they don't compile is no fault.
define compile_packages
@$(1)/bin/python -m compileall -qq -j 0 $(1)/lib || true
endef

$(VENV)/.installed: $(METADATA) constraints.txt
	$(call new_environment,$(VENV))
	$(VENV)/bin/python -m pip install $(PIP_FLAGS) -e '.[train]' -c constraints.txt
	$(call compile_packages,$(VENV))
	@touch $@

$(VENV)/.installed-dev: $(VENV)/.installed
	$(VENV)/bin/python -m pip install $(PIP_FLAGS) -e '.[dev,train,pretrained,parquet,onnx,docs,view,cluster,remote]' -c constraints.txt
	$(call compile_packages,$(VENV))
	@touch $@

$(VENV)/.installed-mutants: $(VENV)/.installed-dev
	$(VENV)/bin/python -m pip install $(PIP_FLAGS) -e '.[mutants]' -c constraints.txt
	@touch $@

$(DEVKIT)/.installed: $(METADATA) conformance/requirements.txt conformance/constraints.txt
	$(call new_environment,$(DEVKIT))
	$(DEVKIT)/bin/python -m pip install $(PIP_FLAGS) -e . -r conformance/requirements.txt -c conformance/constraints.txt
	@touch $@

install: $(VENV)/.installed
	@echo "$(VENV)/bin/ogmkit is installed; $(VENV)/bin/ogmkit --help lists its commands."

# Networks so small gain nothing from a second thread, and wait long for it where another program has the core.
demo: $(VENV)/.installed
	$(VENV)/bin/ogmkit check fixtures/nuscenes-synthetic
	OMP_NUM_THREADS=1 $(VENV)/bin/ogmkit run examples/demo.yaml
	$(VENV)/bin/ogmkit verify demo/shards
	$(VENV)/bin/ogmkit inspect demo/shards
	$(VENV)/bin/ogmkit preview demo/shards --out demo/pictures/preview --view targets --view footprints --view stretch
	@echo
	@echo "20 frames are too few to learn from; networks start from other synthetic scenes. demo/manifest.json says what made what."
	@echo "Open demo/report.html: it shows all of it."

test: $(VENV)/.installed-dev
	$(VENV)/bin/ruff check .
	$(VENV)/bin/ruff format --check .
	$(VENV)/bin/mypy
	$(VENV)/bin/lint-imports --config setup.cfg
	OMP_NUM_THREADS=1 $(VENV)/bin/pytest $(SPREAD)

slow: $(VENV)/.installed-dev
	OMP_NUM_THREADS=1 $(VENV)/bin/pytest -m slow $(SPREAD)

pictures: $(VENV)/.installed
	$(VENV)/bin/python docs/make_pictures.py
	$(VENV)/bin/python docs/concept_pictures.py

site: $(VENV)/.installed-dev
	NO_MKDOCS_2_WARNING=1 $(VENV)/bin/mkdocs build --quiet --site-dir site
	@echo "The site is in site/: $(VENV)/bin/python -m http.server --directory site"

# MINUTES=8 stops sooner; another run goes on with what is missing. Counts are in benchmarks/results/harden.
MINUTES ?= 90
harden: $(VENV)/.installed-dev
	$(VENV)/bin/python tests/faults/harden.py --minutes $(MINUTES)

# A sample of 210 places; outcomes of what hasn't changed since are kept in benchmarks/results/mutants.json.
mutants: $(VENV)/.installed-mutants
	OMP_NUM_THREADS=1 $(VENV)/bin/pytest -q -m "slow or not slow" tests/mutants
	OMP_NUM_THREADS=1 $(VENV)/bin/python tests/mutants/mutants.py

# In new environments, from the index that pip is set to; RELEASE="--only oldest --python 3.11" does a part.
release-check: $(VENV)/.installed-dev
	$(VENV)/bin/python tests/release/check.py $(RELEASE)

conformance-env: $(DEVKIT)/.installed

environments: $(DEVKIT)/.installed $(VENV)/.installed-dev

conformance: $(DEVKIT)/.installed
	MPLBACKEND=Agg OMP_NUM_THREADS=1 $(DEVKIT)/bin/pytest $(SPREAD) conformance $(EXACT)

bench: $(VENV)/.installed $(DEVKIT)/.installed
	@$(DEVKIT)/bin/python benchmarks/drivable.py
	@$(DEVKIT)/bin/python benchmarks/layers.py
	@$(VENV)/bin/python benchmarks/frame.py
	@$(VENV)/bin/python benchmarks/homographies.py
	@$(VENV)/bin/python benchmarks/footprints.py
	@$(VENV)/bin/python benchmarks/workers.py
	@$(VENV)/bin/python benchmarks/loading.py
	@$(VENV)/bin/python benchmarks/planner_inputs.py
	@$(VENV)/bin/python benchmarks/looking.py
	@$(VENV)/bin/python benchmarks/tables.py
	@$(VENV)/bin/python benchmarks/startup.py

# What is missing is made, two parts at a time; LEARN="--minutes 120" starts none after two hours.
bench-learn: $(VENV)/.installed-dev
	$(VENV)/bin/python benchmarks/perception.py $(LEARN)

bench-plan: $(VENV)/.installed-dev
	$(VENV)/bin/python benchmarks/planning.py $(PLAN)

bench-tables: $(VENV)/.installed-dev
	$(VENV)/bin/python benchmarks/assemble.py

bench-real: $(VENV)/.installed-dev
	$(VENV)/bin/python benchmarks/real.py $(REAL)

# Leave the machine alone meanwhile; a part at a time, and what is there is kept.
bench-scale: $(VENV)/.installed
	$(VENV)/bin/python benchmarks/scale.py $(SCALE)

# The weights that the demo's networks start from: three quarters of an hour of a core.
demo-start: $(VENV)/.installed
	OMP_NUM_THREADS=1 $(VENV)/bin/python fixtures/make_demo_start.py
