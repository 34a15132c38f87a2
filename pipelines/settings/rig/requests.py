"""The requests that read or write a block: none beyond a device's limits, no value cut in two."""

from collections.abc import Iterable


def requests_of(spans: Iterable[range], most: int, *, across_gaps: bool = True) -> list[range]:
    """Return the fewest requests that carry all values of a block.

    Parameters
    ----------
    spans : iterable of range
        Addresses of each value, which one request must carry; none longer than ``most``.
    most : int
        Registers that one request carries.
    across_gaps : bool, optional
        Whether a request may carry registers between values, too.

    Returns
    -------
    list of range
        Addresses of each request, ascending.
    """
    requests: list[range] = []
    for span in sorted(spans, key=lambda one: one.start):
        if requests and span.stop <= requests[-1].stop:  # such as a direction that two values share
            continue
        # A request takes each value that still fits: one that ends earlier never saves another.
        fits = requests and span.stop - requests[-1].start <= most
        if fits and (across_gaps or span.start == requests[-1].stop):
            requests[-1] = range(requests[-1].start, span.stop)
        else:
            requests.append(span)
    return requests
