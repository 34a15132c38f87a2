"""Explain why two causes are not separated, and how to separate them."""

from pipelines.effects import Effect, Tie


def tie_between(named: Effect, other: Effect) -> Tie:
    """Return why two effects are not separated, for any data or on this motion only."""
    # Either effect may list the tie.
    structural = named.ties.get(other.name) or other.ties.get(named.name)
    return structural or Tie(
        "on this motion the difference of their torques is below the noise, or other parameters"
        " compensate it",
        f"for the one: {named.confirm}; for the other: {other.confirm}",
    )
