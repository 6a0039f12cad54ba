# Each target makes the environment that it needs. Stamp files remember what was installed, so a second run of a
# target installs nothing; `make PYTHON=python3.12 …` chooses the interpreter of a new environment.
PYTHON ?= python3
VENV := .venv
DEVKIT := .venv-devkit
METADATA := setup.cfg pyproject.toml
PIP_FLAGS := --quiet --disable-pip-version-check

.DEFAULT_GOAL := help
.PHONY: help install demo test slow conformance conformance-env bench bench-learn

help:
	@echo "make install      $(VENV) with the ogmkit command and what training needs"
	@echo "make demo         shards, homographies, footprints, a small training and its table, under demo/"
	@echo "make test         linters, types, import contract and tests"
	@echo "make slow         the long tests: four frames learnt by heart, masks of real size"
	@echo "make conformance  ogmkit beside the official nuScenes devkit, in $(DEVKIT)"
	@echo "make bench        the README's figures, measured side by side"
	@echo "make bench-learn  every system trained on a synthetic world, one table; takes hours"

define new_environment
@$(PYTHON) -c 'import sys; sys.exit(None if sys.version_info >= (3, 11) else "ogmkit needs Python 3.11 or newer, \
	and $(PYTHON) is " + sys.version.split()[0] + ": try make PYTHON=python3.12 $(MAKECMDGOALS)")'
@test -x $(1)/bin/python || $(PYTHON) -m venv $(1)
endef

$(VENV)/.installed: $(METADATA) constraints.txt
	$(call new_environment,$(VENV))
	$(VENV)/bin/python -m pip install $(PIP_FLAGS) -e '.[train]' -c constraints.txt
	@touch $@

$(VENV)/.installed-dev: $(VENV)/.installed
	$(VENV)/bin/python -m pip install $(PIP_FLAGS) -e '.[dev,train,onnx]' -c constraints.txt
	@touch $@

$(DEVKIT)/.installed: $(METADATA) conformance/requirements.txt conformance/constraints.txt
	$(call new_environment,$(DEVKIT))
	$(DEVKIT)/bin/python -m pip install $(PIP_FLAGS) -e . -r conformance/requirements.txt -c conformance/constraints.txt
	@touch $@

install: $(VENV)/.installed
	@echo "$(VENV)/bin/ogmkit is installed; $(VENV)/bin/ogmkit --help lists its commands."

# Small enough for two cores and a minute; DeepLab on ResNet-101 at 448x800 is the default.
SMALL := --encoder resnet18 --image-size 96x160 --optimizer adamw --workers 0

demo: $(VENV)/.installed
	$(VENV)/bin/ogmkit check fixtures/nuscenes-synthetic
	$(VENV)/bin/ogmkit extract fixtures/nuscenes-synthetic demo/shards --overwrite --workers 2
	$(VENV)/bin/ogmkit homography-fit demo/shards --plot demo/homographies.png
	$(VENV)/bin/ogmkit render-footprints demo/shards --scale 1
	$(VENV)/bin/ogmkit render-footprints demo/shards --scale 1 --method full-body
	$(VENV)/bin/ogmkit verify demo/shards
	$(VENV)/bin/ogmkit inspect demo/shards
	$(VENV)/bin/ogmkit preview demo/shards --out demo/pictures --view targets --view footprints --view stretch
	$(VENV)/bin/ogmkit train homography demo/shards --out demo/runs/homography --overwrite $(SMALL) --epochs 8
	$(VENV)/bin/ogmkit predict homography demo/shards --checkpoint demo/runs/homography --overwrite
	$(VENV)/bin/ogmkit render-footprints demo/shards --homography network --scale 1 --overwrite
	$(VENV)/bin/ogmkit train footprints demo/shards --out demo/runs/footprints --overwrite $(SMALL) --epochs 20
	$(VENV)/bin/ogmkit evaluate demo/shards demo/runs/footprints --pictures demo/evaluation
	@echo
	@echo "Look at demo/pictures, demo/homographies.png and demo/evaluation; the shards they come from are"
	@echo "demo/shards/*.h5, the trainings are in demo/runs. Twenty frames teach little: it shows the way, not the worth."

test: $(VENV)/.installed-dev
	$(VENV)/bin/ruff check .
	$(VENV)/bin/ruff format --check .
	$(VENV)/bin/mypy
	$(VENV)/bin/lint-imports --config setup.cfg
	$(VENV)/bin/pytest

slow: $(VENV)/.installed-dev
	$(VENV)/bin/pytest -m slow

conformance-env: $(DEVKIT)/.installed

conformance: $(DEVKIT)/.installed
	MPLBACKEND=Agg $(DEVKIT)/bin/pytest conformance
	$(DEVKIT)/bin/pytest

bench: $(VENV)/.installed $(DEVKIT)/.installed
	@$(DEVKIT)/bin/python benchmarks/drivable.py
	@$(VENV)/bin/python benchmarks/frame.py
	@$(VENV)/bin/python benchmarks/homographies.py
	@$(VENV)/bin/python benchmarks/footprints.py
	@$(VENV)/bin/python benchmarks/workers.py
	@$(VENV)/bin/python benchmarks/loading.py
	@$(VENV)/bin/python benchmarks/tables.py
	@$(VENV)/bin/python benchmarks/startup.py

bench-learn: $(VENV)/.installed-dev
	$(VENV)/bin/python benchmarks/perception.py
