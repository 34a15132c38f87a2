"""What a verdict is worth against the truth."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from tests.blind.faults import WORDS

Named = tuple[str, str | None]
JOINTS = ("hip", "knee")
SILENT = "nothing_missing"


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
    """What rigid body and friction cannot imitate of it, over the noise floor, at the joint where that is most."""
    kinds: tuple[str, ...]
    status: str
    """The verdict's, or ``refused``, ``crashed``, ``fault`` where a data fault was named."""
    named: tuple[Named, ...]
    right: bool
    unseen: bool = False
    """Silence about what was too small to be seen."""
    probabilities: tuple[tuple[float, bool], ...] = ()
    """Of each named cause, and whether it was there (or tied with what was)."""
    rmse_over_floor: Mapping[str, float] = field(default_factory=dict)
    floor_over_truth: Mapping[str, float] = field(default_factory=dict)
    covered: tuple[tuple[str, str, bool], ...] = ()
    """Effect, parameter, and whether its 95 % interval holds the truth."""
    seconds: float = 0.0
    machine: str = "leg"

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
        ``exit_code``, ``message`` (what the command said), ``seconds``, and ``verdict`` (``verdict/1``, or None).
    smallest : mapping, optional
        Smallest visible size of each cause, rms N·m; without it silence about an effect is always wrong.
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
    unseen = _unseen(truth, smallest) and verdict["status"] == SILENT
    right = {
        "single": lambda: bool(causes) and hidden[0] in names_of(causes[0]),
        "pair": lambda: all(any(h in names_of(c) for c in causes) for h in hidden),
        "none": lambda: verdict["status"] == SILENT and not verdict["data_faults"],
        "imperfect": lambda: verdict["status"] == SILENT and not verdict["data_faults"],
        "outside": lambda: (
            verdict["status"] == "unknown_cause" or bool(causes and kin & names_of(causes[0]))
        ),
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
            left / truth["noise_floor_nm"][joint]
            for joint, left in truth["left_by_baseline_nm"].items()
        ),
        kinds=tuple(truth["case"]["kinds"]),
        status=verdict["status"],
        named=tuple((c["effect"], c["joint"]) for c in causes),
        right=right or unseen,
        unseen=unseen,
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
    )


def names_of(cause: Mapping[str, Any]) -> set[Named]:
    """Return what a named cause says: itself, and what it honestly cannot be told from."""
    ties = cause.get("indistinguishable_from", [])
    return {(cause["effect"], cause["joint"])} | {(tie["effect"], tie["joint"]) for tie in ties}


def fault_is_named(
    fault: Mapping[str, Any], found: Iterable[Mapping[str, Any]], message: str
) -> bool:
    """Tell whether a data fault was said, in the verdict or in the line with which the command refused the files.

    Right are a file that has the fault and a word for what it is; where one channel has it, that channel or joint.
    """
    sentences = [f"{f['file']} {f['channel']} {f['what']}" for f in found] + [message]
    joint = (fault["channel"] or "").split("_")[0]
    return any(
        any(file in said for file in fault["files"])
        and any(word in said.lower() for word in WORDS[fault["fault"]])
        and (joint not in JOINTS or joint in said)
        for said in sentences
    )


def _without_verdict(exit_code: int) -> str:
    return "refused" if exit_code == 2 else "crashed"


def _unseen(truth: Mapping[str, Any], smallest: Mapping[Named, float] | None) -> bool:
    if smallest is None or truth["case"]["category"] != "single":
        return False
    hidden = truth["hidden"][0]
    return hidden["rms_nm"] < smallest.get((hidden["effect"], hidden["joint"]), 0.0)


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
    """Yield whether intervals hold the truth, for causes named rightly, parameters that the plant's form has too."""
    for h in hidden:
        for cause in causes:
            if (cause["effect"], cause["joint"]) != (h["effect"], h["joint"]):
                continue
            for parameter in cause["parameters"]:
                true, interval = h["parameters"].get(parameter["name"]), parameter.get("ci95")
                if true is not None and interval and None not in interval:
                    yield h["effect"], parameter["name"], bool(interval[0] <= true <= interval[1])
