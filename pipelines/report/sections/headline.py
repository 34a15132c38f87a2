"""The top of a page: machine, status and result in one sentence, and its first paragraph."""

from typing import Any

from pipelines.contracts.joints import either
from pipelines.contracts.verdict import Verdict
from pipelines.report.sections.recordings import origin
from pipelines.report.session import Session
from pipelines.wording.causes import causes_in_words


def context(session: Session) -> dict[str, Any]:
    """Return the values that the template's top and several of its parts use."""
    verdict = session.verdict
    return {
        "machine": machine(session),
        "status": status(verdict),
        "headline": headline(session),
        "verdict": verdict,
        "lead": lead(verdict) if verdict else "",
        "faults": _first_fault(verdict) if verdict else ("", 0),
        "damaged_verdict": session.has_damaged_verdict,
        "unreadable": list(session.unreadable.values()),
        "quantity": either(joint.effort for joint in session.joints) or "torque",
        "torque_unit": either(joint.unit("torque") for joint in session.joints) or "N·m",
    }


def machine(session: Session) -> str:
    """Return the joints, and the rig, subject and session of the recordings, in words."""
    joints = " and ".join(joint.name for joint in session.joints)
    # Motions repeat the metadata of their recordings, which a folder may lack.
    origins = [origin(one) for one in session.of_kind("recording") or session.of_kind("motion")]
    about = list(dict.fromkeys(filter(None, origins)))
    return " · ".join(filter(None, (joints, "; ".join(about[:3]))))


def status(verdict: Verdict | None) -> dict[str, str]:
    """Return a verdict's status in words, and the tone of its badge."""
    if not verdict:
        return {"words": "not diagnosed", "tone": ""}
    # Before the status, because no cause is sought in faulty recordings.
    if verdict.acquisition_at_fault:
        return {"words": "acquisition, not physics", "tone": "bad"}
    words_of = {
        "explained": ("explained", "good"),
        "partly_explained": ("partly explained", "warn"),
        "unknown_cause": ("cause unknown", "warn"),
        "nothing_missing": ("nothing missing", "good"),
    }
    words, tone = words_of.get(verdict.status, (verdict.status.replace("_", " "), ""))
    return {"words": words, "tone": tone}


def headline(session: Session) -> str:
    """Return the result in one short sentence."""
    verdict = session.verdict
    if not verdict:
        return "The verdict cannot be read" if session.has_damaged_verdict else "Not diagnosed yet"
    if verdict.acquisition_at_fault:
        return "The recordings are at fault, not the model"
    if verdict.causes:
        return f"The simulation misses {causes_in_words(verdict.causes)}"
    # The tree may know joint or family of what no listed cause explains.
    if verdict.status == "unknown_cause" and verdict.findings:
        missing = verdict.findings[0].words
        return f"The simulation misses {missing}, and no listed cause explains it"
    headlines = {
        "unknown_cause": "Something is missing that no listed cause explains",
        "nothing_missing": "Nothing is missing that these data could show",
    }
    return headlines.get(verdict.status, verdict.status.replace("_", " "))


def lead(verdict: Verdict) -> str:
    """Return the finding in two sentences; the whole summary in files of older versions."""
    return verdict.finding or verdict.summary


def _first_fault(verdict: Verdict) -> tuple[str, int]:
    """Return the first data fault next to a finding, and the number of others; empty if none."""
    if not verdict.data_faults or not verdict.finding:
        return "", 0
    first, *others = verdict.data_faults
    return f"{first.file}, {first.channel}: {first.what}", len(others)
