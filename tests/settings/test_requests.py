"""The requests of a block carry every value whole, within the device's limit, and are few."""

from itertools import combinations, pairwise

from hypothesis import given
from hypothesis import strategies as st

from pipelines.settings.rig.requests import requests_of


@st.composite
def blocks(draw):
    """Addresses of values of 1, 2 or 4 words, with gaps between some of them."""
    spans, address = [], draw(st.integers(0, 100))
    for _ in range(draw(st.integers(1, 7))):
        words = draw(st.sampled_from([1, 2, 4]))
        spans.append(range(address, address + words))
        address += words + draw(st.sampled_from([0, 0, 1, 9]))
    return draw(st.permutations(spans))


def carries(request, span):
    return request.start <= span.start and span.stop <= request.stop


@given(blocks(), st.integers(4, 30), st.booleans())
def test_every_value_is_in_one_request_whole_and_no_request_is_too_long(spans, most, across_gaps):
    requests = requests_of(spans, most, across_gaps=across_gaps)
    assert all(sum(carries(request, span) for request in requests) == 1 for span in spans)
    assert all(0 < len(request) <= most for request in requests)
    assert all(one.stop <= other.start for one, other in pairwise(requests))
    named = {address for span in spans for address in span}
    for request in requests:
        assert {request.start, request.stop - 1} <= named
        assert across_gaps or set(request) <= named


@given(blocks(), st.integers(4, 30))
def test_no_other_split_of_a_block_needs_fewer_requests(spans, most):
    ordered = sorted(spans, key=lambda span: span.start)
    fewest = len(requests_of(spans, most))
    for cuts in combinations(range(1, len(ordered)), max(fewest - 2, 0)):
        ends = [*cuts, len(ordered)] if fewest > 1 else []
        parts = [ordered[a:b] for a, b in zip([0, *cuts], ends, strict=True)] if ends else []
        if parts:
            assert any(part[-1].stop - part[0].start > most for part in parts)
