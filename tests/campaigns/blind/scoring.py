"""What a verdict is worth against the truth."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from math import log
from typing import Any

from tests.campaigns.blind.faults import WORDS

Named = tuple[str, str | None]
JOINTS = ("hip", "knee")
SILENT = "nothing_missing"
LIKELY = 0.5
"""Probability from which something counts as said."""
LEAST = 1e-4
"""Least probability whose logarithm is taken."""


@dataclass(frozen=True)
class Score:
    """One case: what was hidden, what was answered, and whether that is right."""

    seed: int
    category: str
    truth: tuple[Named, ...]
    forms: tuple[str, ...]
    own_form: bool
    """Are all hidden forms the catalogue's own?"""
    magnitude: float | None
    """Of a single effect."""
    visibility: float
    """What rigid body and friction cannot imitate of it, over the noise floor, at the joint where
    that is most."""
    kinds: tuple[str, ...]
    status: str
    """The verdict's, or ``refused``, ``crashed``, ``fault`` where a data fault was named."""
    named: tuple[Named, ...]
    right: bool
    unseen: bool = False
    """Whether all that is not named was too small to be seen. Of a single effect silence is then
    right, of a pair it is counted separately."""
    probabilities: tuple[tuple[float, bool], ...] = ()
    """Of each named cause, and whether it was there (or tied with what was)."""
    rmse_over_floor: Mapping[str, float] = field(default_factory=dict)
    floor_over_truth: Mapping[str, float] = field(default_factory=dict)
    covered: tuple[tuple[str, str, bool], ...] = ()
    """Effect, parameter, and whether its 95 % interval holds the truth."""
    seconds: float = 0.0
    machine: str = "leg"
    world: str = "mujoco"
    held_back: bool = False
    """Is it of a kind that is never shown to what learns?"""
    family_right: bool | None = None
    """Is a finding of an acceptable family, at the right joint, at least as likely as not? None
    where nothing is hidden, or the verdict has no findings."""
    log_probability: float | None = None
    """Natural logarithm of the probability given to the truth; None where the verdict has
    none."""

    @property
    def first(self) -> str:
        """What a confusion matrix counts: the first cause named, or the status."""
        return self.named[0][0] if self.named else self.status


def score(
    truth: Mapping[str, Any],
    answer: Mapping[str, Any],
    smallest: Mapping[Named, float] | None = None,
) -> Score:
    """Compare an answer with the truth.

    Parameters
    ----------
    truth : mapping
        A truth file.
    answer : mapping
        ``exit_code``, ``message`` (what the command said), ``seconds``, and ``verdict``
        (``verdict/1``, or None).
    smallest : mapping, optional
        Smallest visible size of each cause, rms N·m; without it silence about an effect is always
        wrong.
    """
    category = truth["case"]["category"]
    verdict = answer["verdict"] or {
        "status": _without_verdict(answer["exit_code"]),
        "causes": [],
        "data_faults": [],
    }
    hidden = tuple((h["effect"], h["joint"]) for h in truth["hidden"])
    causes = verdict["causes"]
    kin = {(effect, h["joint"]) for h in truth["hidden"] for effect in h["kin"]}
    faults = [f for f in verdict["data_faults"] if not _is_a_declared_gap(f, truth)]
    unseen = _unseen(truth, causes, smallest)
    silence_is_right = category == "single" and unseen and verdict["status"] == SILENT
    right = {
        "single": lambda: bool(causes) and hidden[0] in names_of(causes[0]),
        "pair": lambda: all(any(h in names_of(c) for c in causes) for h in hidden),
        "none": lambda: verdict["status"] == SILENT and not faults,
        "imperfect": lambda: verdict["status"] == SILENT and not faults,
        "outside": lambda: _is_called_unlisted(verdict, kin),
        "fault": lambda: fault_is_named(truth["fault"], verdict["data_faults"], answer["message"]),
    }[category]()
    return Score(
        seed=truth["case"]["seed"],
        category=category,
        truth=hidden or ((truth["fault"]["fault"], None),) if truth["fault"] else hidden,
        forms=tuple(h["form"] for h in truth["hidden"]),
        own_form=all(h["own_form"] for h in truth["hidden"]),
        magnitude=truth["hidden"][0]["magnitude"] if len(hidden) == 1 else None,
        visibility=max(
            residual / truth["noise_floor_nm"][joint]
            for joint, residual in truth["left_by_baseline_nm"].items()
        ),
        kinds=tuple(truth["case"]["kinds"]),
        status=verdict["status"],
        named=tuple((c["effect"], c["joint"]) for c in causes),
        right=right or silence_is_right,
        unseen=unseen if category == "pair" else silence_is_right,
        probabilities=tuple(
            (float(c["probability"]), any(h in names_of(c) for h in (*hidden, *kin)))
            for c in causes
            if category != "fault"
        ),
        rmse_over_floor=_ratio(verdict.get("extended_rmse_nm"), truth["noise_floor_nm"], category),
        floor_over_truth=_ratio(verdict.get("noise_floor_nm"), truth["noise_floor_nm"], category),
        covered=tuple(_covered(truth["hidden"], causes)),
        seconds=float(answer["seconds"]),
        machine=truth["case"]["machine"],
        world=truth["case"].get("world", "mujoco"),
        held_back=any(h.get("held_back", False) for h in truth["hidden"]),
        family_right=_family_is_right(truth["hidden"], verdict.get("findings")),
        log_probability=_log_probability(truth, verdict.get("posterior")),
    )


def _is_called_unlisted(verdict: Mapping[str, Any], kin: set[Named]) -> bool:
    """Return whether something is missing and no listed cause is likely, except for its kin."""
    if verdict["status"] not in ("unknown_cause", "partly_explained", "explained"):
        return False
    likely = [c for c in verdict["causes"] if float(c["probability"]) >= LIKELY]
    return all(kin & names_of(c) for c in likely)


def _is_a_declared_gap(fault: Mapping[str, Any], truth: Mapping[str, Any]) -> bool:
    """Return whether a data fault is in the file's own metadata: samples that it lost."""
    words = ("gap", "missing", "dropped", "lost")
    declared = fault["file"] in truth.get("with_gaps", ())
    return declared and any(word in fault["what"].lower() for word in words)


def _family_is_right(
    hidden: Sequence[Mapping[str, Any]], findings: Sequence[Mapping[str, Any]] | None
) -> bool | None:
    """Return whether each hidden effect has a likely finding of its kind of law at its joint."""
    with_family = [h for h in hidden if h.get("families")]
    if findings is None or not with_family:
        return None
    return all(any(_is_of_family(finding, h) for finding in findings) for h in with_family)


def _is_of_family(finding: Mapping[str, Any], hidden: Mapping[str, Any]) -> bool:
    anywhere = hidden["joint"] is None or hidden.get("at_both_joints", False)
    at_joint = anywhere or finding.get("joint") in (None, hidden["joint"])
    of_family = finding.get("family") in hidden["families"]
    return bool(at_joint and of_family and float(finding["probability"]) >= LIKELY)


def _log_probability(truth: Mapping[str, Any], posterior: Mapping[str, Any] | None) -> float | None:
    """Return the mean logarithm of the probabilities of all that is true, each at least
    ``LEAST``."""
    category = truth["case"]["category"]
    if posterior is None or category == "fault":
        return None
    if category in ("none", "imperfect"):
        true = [posterior.get("nothing_missing", 0.0)]
    else:
        true = [_probability_of(h, posterior) for h in truth["hidden"]]
    return sum(log(max(LEAST, float(p))) for p in true) / len(true)


def _probability_of(hidden: Mapping[str, Any], posterior: Mapping[str, Any]) -> float:
    causes, joint = posterior.get("causes", {}), hidden["joint"]
    names = [hidden["effect"], *hidden["kin"]]
    probabilities = [
        causes.get(name if joint is None else f"{name}@{joint}", 0.0) for name in names
    ]
    if hidden["effect"].startswith("outside:"):
        probabilities.append(posterior.get("unlisted", 0.0))
    return max(probabilities)


def names_of(cause: Mapping[str, Any]) -> set[Named]:
    """Return the labels of a named cause: its own, and those of its ties."""
    ties = cause.get("indistinguishable_from", [])
    return {(cause["effect"], cause["joint"])} | {(tie["effect"], tie["joint"]) for tie in ties}


def fault_is_named(
    fault: Mapping[str, Any], faults: Iterable[Mapping[str, Any]], message: str
) -> bool:
    """Return whether the verdict, or the command's refusal of the files, names a data fault.

    Right are a file that has the fault and a word for what it is; where one channel has it, that
    channel or joint.
    """
    sentences = [f"{f['file']} {f['channel']} {f['what']}" for f in faults] + [message]
    joint = (fault["channel"] or "").split("_")[0]
    return any(
        any(file in sentence for file in fault["files"])
        and any(word in sentence.lower() for word in WORDS[fault["fault"]])
        and (joint not in JOINTS or joint in sentence)
        for sentence in sentences
    )


def _without_verdict(exit_code: int) -> str:
    return "refused" if exit_code == 2 else "crashed"


def _unseen(
    truth: Mapping[str, Any],
    causes: Iterable[Mapping[str, Any]],
    smallest: Mapping[Named, float] | None,
) -> bool:
    """Return whether all that is hidden and not named is too small to be seen; False where all is
    named."""
    if smallest is None or truth["case"]["category"] not in ("single", "pair"):
        return False
    named = {name for cause in causes for name in names_of(cause)}
    missed = [h for h in truth["hidden"] if (h["effect"], h["joint"]) not in named]
    small = [h["rms_nm"] < smallest.get((h["effect"], h["joint"]), 0.0) for h in missed]
    return bool(missed) and all(small)


def _ratio(
    values: Mapping[str, float] | None, floor: Mapping[str, float], category: str
) -> dict[str, float]:
    if not values or category == "fault":
        return {}
    return {
        joint: values[joint] / noise
        for joint, noise in floor.items()
        if values.get(joint) is not None
    }


def _covered(hidden: Iterable[Mapping[str, Any]], causes: Iterable[Mapping[str, Any]]):
    """Yield whether intervals hold the truth, for causes named rightly, parameters that the plant's
    form has too."""
    for h in hidden:
        for cause in causes:
            if (cause["effect"], cause["joint"]) != (h["effect"], h["joint"]):
                continue
            for parameter in cause["parameters"]:
                true, interval = h["parameters"].get(parameter["name"]), parameter.get("ci95")
                if true is not None and interval and None not in interval:
                    yield h["effect"], parameter["name"], bool(interval[0] <= true <= interval[1])
