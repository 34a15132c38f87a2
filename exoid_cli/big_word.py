"""Words that are read across a room: letters of three by five blocks."""

HEIGHT = 5
LETTERS = {
    "A": "### # # ### # # # #",
    "B": "##  # # ##  # # ## ",
    "E": "### #   ##  #   ###",
    "I": "###  #   #   #  ###",
    "L": "#   #   #   #   ###",
    "M": "# # ### ### # # # #",
    "N": "##  # # # # # # # #",
    "O": "### # # # # # # ###",
    "P": "### # # ### #   #  ",
    "R": "##  # # ##  # # # #",
    "S": "### #   ###   # ###",
    "T": "###  #   #   #   # ",
    "-": "        ###        ",
    " ": "                   ",
}
"""Five rows of three, a space between."""


def big(word: str) -> list[str]:
    """Return a word's five lines, four characters a letter but the last."""
    return [
        " ".join(LETTERS[c][4 * row : 4 * row + 3] for c in word).replace("#", "█")
        for row in range(HEIGHT)
    ]
