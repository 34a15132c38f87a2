"""Rows faster than the bus: values that are held until the next message comes."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pipelines.importing.finding import Finding
from pipelines.importing.time.clock import Run
from pipelines.signals.held import are_held, new_values
from pipelines.signals.sampling import between_samples, sample_rate


def remarks(run: Run, columns: Mapping[str, NDArray]) -> list[Finding]:
    """Report the columns (n,) of a run that hold their values, with the rate of the new ones."""
    rows_hz, findings = sample_rate(run.time_s), []
    for name, values in columns.items():
        if are_held(values):
            new_hz = sample_rate(run.time_s[new_values(values)])
            seen = f"new values at {new_hz:.4g} Hz in rows at {rows_hz:.4g} Hz, repeated between"
            findings.append(Finding(name, seen, 'kept; set time.keep = "new" to leave repeats out'))
    return findings


def only_new(
    run: Run, columns: Mapping[str, NDArray], required: Sequence[str], findings: list[Finding]
) -> tuple[Run, dict[str, NDArray]]:
    """Return the rows of a run that bring new values, and the columns there.

    Parameters
    ----------
    run : Run
        n rows.
    columns : mapping of str to (n,) array
        Quantities, NaN where missing.
    required : sequence of str
        Columns that a recording needs, the torque last. It has the instants of the result; others
        that are held and change at other instants are interpolated.
    findings : list of Finding
        Extended by what was done.

    Returns
    -------
    Run, dict
        Of m rows.
    """
    held = {name: new_values(values) for name, values in columns.items() if are_held(values)}
    bases = [name for name in required if name in held]
    if not bases:
        findings.append(Finding("time", "no angle or torque repeats its values", "all rows kept"))
        return run, dict(columns)
    base = bases[-1]
    together = {name for name, new in held.items() if _coincide(new, held[base])}
    # A value may come again as it was, while another of its message is new.
    rows = np.unique(np.concatenate([held[name] for name in together]))
    kept = {name: values[rows] for name, values in columns.items()}
    time_s = run.time_s[rows]
    seen = f"new values at {sample_rate(time_s):.4g} Hz in rows at {sample_rate(run.time_s):.4g} Hz"
    action = f"{len(run) - len(rows)} rows that repeat {', '.join(sorted(together))} left out"
    findings.append(Finding("time", seen, action))
    for name in held.keys() - together:
        kept[name] = between_samples(run.time_s[held[name]], columns[name][held[name]], time_s)
        seen = "new values at other instants than the torque's"
        findings.append(Finding(name, seen, "interpolated linearly between them"))
    began_s = run.began_s + float(time_s[0])
    return replace(run, rows=run.rows[rows], time_s=time_s - time_s[0], began_s=began_s), kept


def _coincide(one: NDArray, other: NDArray) -> bool:
    """Return whether most rows (k,) of the rarer of two channels are also of the other."""
    return len(np.intersect1d(one, other)) > 0.8 * min(len(one), len(other))
