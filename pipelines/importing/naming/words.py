"""The words of a column's name."""

import re
import unicodedata

UMLAUTS = str.maketrans(
    {"ä": "ae", "ö": "oe", "ü": "ue", "Ä": "Ae", "Ö": "Oe", "Ü": "Ue", "ß": "ss"}
)


def plain_words(name: str) -> list[str]:
    """Return the words of a name in lower case, split at marks, digits and capitals."""
    # Umlauts are spelled out before accents are dropped: ü is ue in German words, é is e.
    plain = "".join(
        letter
        for letter in unicodedata.normalize("NFKD", name.translate(UMLAUTS))
        if not unicodedata.combining(letter)
    )
    return [word.lower() for word in re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])|\d+", plain)]
