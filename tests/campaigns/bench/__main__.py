"""``make bench``: all speeds in one run. docs/benchmarks.md tells what was measured, and on which
machine."""

import os

# Before NumPy is loaded: one core is what each comparison is about.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from tests.campaigns.bench import (
    bench_acquire,
    bench_all,
    bench_at_once,
    bench_design,
    bench_diagnose,
    bench_import,
    bench_operator_view,
    bench_simulate,
    bench_stream,
)
from tests.campaigns.bench.report import show

show("exoid design", bench_design.rows())
show("exoid simulate", bench_simulate.rows())
show("exoid diagnose", bench_diagnose.rows())
show("exoid acquire", bench_acquire.rows())
show("the operator's view", bench_operator_view.rows())
show("exoid filter and identify", bench_stream.rows())
show("exoid import", bench_import.rows())
show("make all", bench_all.rows())
show("four commands at once", bench_at_once.rows())
