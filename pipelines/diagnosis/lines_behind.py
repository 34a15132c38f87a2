"""Seek lines again in the residual that the named causes leave.

A large slow error, as of friction that builds up, raises the level that a line has to stand out of.
Once its cause is known and subtracted, weaker lines stand out, and the orders of strong ones are
sharper.
"""

from dataclasses import replace

from pipelines.diagnosis.evidence.line_spectrum import Kind
from pipelines.diagnosis.evidence.order_tracking import JointLines, lines_in
from pipelines.diagnosis.evidence.prepared_runs import PreparedRuns
from pipelines.diagnosis.fit.fitted_model import model_of_run
from pipelines.diagnosis.fit.joint_fit import Fit, with_loads_of
from pipelines.diagnosis.judged_fit import JudgedFit


def with_lines_behind(prepared: PreparedRuns, judged: JudgedFit) -> PreparedRuns:
    """Return the runs with the lines that stand out behind the named causes.

    Where no joint has a further line over its angle, they are returned unchanged.

    Parameters
    ----------
    prepared : PreparedRuns
        With the lines in the baseline's residual.
    judged : JudgedFit
        The named causes, found with those lines.
    """
    causes = judged.after.fit.causes
    others = [cause.label for cause in causes if not cause.effect.order_tracked]
    if not others:
        return prepared
    # A ripple stays in the residual, so that all of its lines are found together.
    with_others = judged.scheme.refitted(judged.after, others)
    lines = _lines_behind(with_others.fit, prepared)
    pairs = zip(prepared.lines, lines, strict=True)
    if not any(_has_further(before, behind) for before, behind in pairs):
        return prepared
    return replace(prepared, lines=lines)


def _lines_behind(fit: Fit, prepared: PreparedRuns) -> tuple[JointLines, ...]:
    """Return each joint's lines in the residual of a fit at the full sampling rate."""
    runs = with_loads_of(prepared.runs, fit, prepared.baseline)
    motions = [run.motion for run in runs]
    residuals = [
        motion.torque - model_of_run(fit, prepared.baseline, run).torque(motion)
        for motion, run in zip(motions, runs, strict=True)
    ]
    return tuple(lines_in(motions, residuals))


def _has_further(before: JointLines, behind: JointLines) -> bool:
    """Return whether a joint has a line over its angle that it did not have before."""
    known = [line.cycles for line in before.of_kind(Kind.ANGLE)]
    width = behind.over_angle.width
    return any(
        all(abs(line.cycles - cycles) > width for cycles in known)
        for line in behind.of_kind(Kind.ANGLE)
    )
