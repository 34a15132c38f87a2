"""The numbers of a module of which they are known."""

from pytest import approx

from tests.campaigns.readability import Module, measure

SOURCE = '''"""What it is."""

LIMIT, other = 1, 2  # why


def f(a):
    """Add one.

    Returns
    -------
    int
    """
    if (b := a + LIMIT) > 2:
        return b
    return a


def g(): ...


class C:
    def _own(self): ...
'''


def test_numbers_of_a_module():
    values = measure([Module.parse(SOURCE)])
    assert values == {
        "lines": 22,
        "median characters of a line of code": 10.5,
        "lines of more than 100 columns, %": 0,
        "public functions with numpydoc sections, %": 50,
        "comments in 100 lines": approx(100 / 22),
        "constants of modules in 100 lines": approx(100 / 22),
        "'what' in 1,000 words of docstrings": approx(1000 / 7),
        "lines that the formatter skips": 0,
        "assignment expressions": 1,
    }
