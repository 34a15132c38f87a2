"""What detection lines show, as rows of a table and sentences for terminal and report."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pipelines.contracts.verdict import LineClasses, Verdict

HEADINGS = ("joint, torque", "excited", "odd lines", "even lines")
"""Of the columns of ``rows``."""


def rows(verdict: "Verdict") -> list[tuple[str, ...]]:
    """Return the rms of what repeats in each class of lines, and the p-values of the residual."""
    table = []
    for joint, lines in verdict.detection_lines.items():
        unit = verdict.units[joint]["torque"]
        amounts = {
            "measured": lines.measured_nm,
            "predicted": lines.predicted_nm,
            "residual": lines.residual_nm,
            "residual with the causes": lines.extended_residual_nm,
        }
        table += [
            (f"{joint}, {name} ({unit})", *_numbers(of_classes, ".3f"))
            for name, of_classes in amounts.items()
            if of_classes is not None
        ]
        tests = {"p-value": lines.p_value, "p-value with the causes": lines.extended_p_value}
        table += [
            (f"{joint}, {name}", *_numbers(of_classes, ".2g"))
            for name, of_classes in tests.items()
            if of_classes is not None
        ]
    return table


def notes(verdict: "Verdict") -> list[str]:
    """Return sentences that explain the table."""
    sentences = [
        "Odd and even lines are not excited: what repeats there is odd or even distortion. P-value:"
        " that the residual away from reversals is no more than noise.",
        "It is of the same samples as the probabilities, and no further evidence.",
    ]
    for joint, lines in verdict.detection_lines.items():
        unit = verdict.units[joint]["torque"]
        noise = f"{joint}: noise {lines.noise_nm:.3f} {unit}, {lines.periods} periods"
        if lines.change_nm is not None and lines.change_p_value is not None:
            noise += (
                f"; change over a run {lines.change_nm:.3f} {unit}, p-value"
                f" {lines.change_p_value:.2g}"
            )
        sentences.append(f"{noise}.")
    return sentences


def _numbers(of_classes: "LineClasses", digits: str) -> tuple[str, ...]:
    return tuple(f"{getattr(of_classes, name):{digits}}" for name in ("excited", "odd", "even"))
