# One experiment as a graph of files: `make` brings every result up to date and does nothing where nothing changed.
# A setting counts, not the time of exoid.toml: touching one re-runs only what depends on it.

EXOID ?= exoid
CONFIG ?= exoid.toml
OUT ?= .
SETTINGS := $(OUT)/.settings

.PHONY: all clean
.DELETE_ON_ERROR:

all: # the rest of what it needs stands below, once the runs are known

# Make writes this file first, from the settings, and reads it again: RUNS, VALIDATE_RUNS, a trajectory for each run.
ifneq ($(MAKECMDGOALS),clean)
include $(SETTINGS)/graph.mk
endif

$(SETTINGS)/graph.mk: $(CONFIG) $(wildcard $(dir $(CONFIG))rigs/*.toml $(dir $(CONFIG))../rigs/*.toml)
	@$(EXOID) settings split $(CONFIG) --out $(SETTINGS)

$(SETTINGS)/%.json: # only where one was deleted by hand
	@$(EXOID) settings split $(CONFIG) --out $(SETTINGS)

# A diagnosis measures its gain on validation runs; without one there is none.
all: $(OUT)/identified/parameters.parquet $(if $(VALIDATE_RUNS),$(OUT)/diagnosed/verdict.json) \
     $(OUT)/simulated/rbf.parquet $(VALIDATE_RUNS:%=$(OUT)/simulated/replay-%.parquet)

$(OUT)/trajectory.parquet: $(SETTINGS)/design.json $(SETTINGS)/mechanism.json
	$(EXOID) design --config $(CONFIG) -o $@

$(OUT)/recordings/%.parquet: $(SETTINGS)/acquire.json
	$(EXOID) acquire --config $(CONFIG) --run $* --trajectory $(TRAJECTORY) -o $@

$(OUT)/motions/%.parquet: $(OUT)/recordings/%.parquet $(SETTINGS)/filter.json
	$(EXOID) filter $< --config $(CONFIG) -o $@

RECORDINGS := $(RUNS:%=$(OUT)/recordings/%.parquet)
MOTIONS := $(RUNS:%=$(OUT)/motions/%.parquet)

$(OUT)/identified/parameters.parquet: $(MOTIONS) $(SETTINGS)/identify.json $(SETTINGS)/mechanism.json
	$(EXOID) identify $(MOTIONS) --config $(CONFIG) -o $(@D)/

$(OUT)/diagnosed/verdict.json: $(RECORDINGS) $(SETTINGS)/filter.json $(SETTINGS)/mechanism.json
	$(EXOID) diagnose $(RECORDINGS) --config $(CONFIG) --out $(@D)/

$(OUT)/simulated/rbf.parquet: $(OUT)/identified/parameters.parquet $(SETTINGS)/simulate.json $(SETTINGS)/mechanism.json
	$(EXOID) simulate $< --config $(CONFIG) -o $(@D)/

$(OUT)/simulated/replay-%.parquet: $(OUT)/identified/parameters.parquet $(OUT)/recordings/%.parquet
	$(EXOID) simulate $< --replay $(OUT)/recordings/$*.parquet --config $(CONFIG) -o $@

# Kept: a recording and a motion are results, not steps on the way.
.SECONDARY:

clean: # all but the recordings, which no command can bring back
	rm -rf $(SETTINGS) $(addprefix $(OUT)/,trajectory.parquet motions identified diagnosed simulated)
