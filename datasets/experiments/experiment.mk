# One experiment: `make` brings every result up to date and does nothing where nothing changed.
# A setting counts, not the time of exoid.toml: touching one re-runs only what depends on it.
# `make -j2` does two steps at a time, but one at a time where a rig moves in real time.

EXOID ?= exoid
CONFIG ?= exoid.toml
OUT ?= .
SETTINGS := $(OUT)/.settings

.PHONY: all clean
.DELETE_ON_ERROR:

all: # the rest of what it needs stands below, once its graph is known

# Make writes these rules first, from the settings, and reads them again. Which file comes from which is written in
# exoid, once: `exoid status` shows it, too, and `exoid run` does the same without make.
ifneq ($(MAKECMDGOALS),clean)
include $(SETTINGS)/graph.mk
endif

$(SETTINGS)/graph.mk: $(firstword $(MAKEFILE_LIST)) $(CONFIG) \
    $(wildcard $(dir $(CONFIG))rigs/*.toml $(dir $(CONFIG))../rigs/*.toml)
	@$(EXOID) settings split $(CONFIG) --out $(SETTINGS) --quiet

$(SETTINGS)/%.json: # only where one was deleted by hand
	@$(EXOID) settings split $(CONFIG) --out $(SETTINGS) --quiet

all: $(RESULTS)

# Kept: a recording and a motion are results, not steps on the way.
.SECONDARY:

clean: # all but the recordings, which no command can bring back
	rm -rf $(SETTINGS) $(addprefix $(OUT)/,trajectory.parquet motions identified diagnosed simulated report.html)
