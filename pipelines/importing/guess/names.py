"""What the name of a column says: its quantity, its joint, its unit, and whether it was
measured."""

import re
import unicodedata
from collections.abc import Iterable
from dataclasses import dataclass, replace

from pipelines.importing.guess.unit_in_name import BRACKETS, QUANTITIES, UnitInName, unit_in
from pipelines.settings.units import UNITS


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


WORDS: dict[str, frozenset[str]] = {
    quantity: _words(words)
    for quantity, words in {
        "time": "time t stamp timestamp timestamps clock zeit uhrzeit zeitstempel temps horodatage",
        "acceleration": "acc accel acceleration ddq qdd beschleunigung beschl",
        "velocity": (
            "vel velo velocity speed omega dq qd qdot dtheta thetadot drehzahl geschwindigkeit"
            " geschw vitesse"
        ),
        "torque": "tau torque trq tq effort moment drehmoment couple",
        "temperature": "temp temperature temperatur",
        "current": "cur current amp iq isq i strom courant intensite",
        "voltage": "vir u voltage spannung",
        "angle": (
            "pos position angle ang theta th q qm phi enc encoder winkel drehwinkel lage stellung"
            " geber weg hub displacement travel stroke codeur course"
        ),
        "force": "force load kraft last",
    }.items()
}
"""Words for each quantity, English, German and French; the first that has one of a name's is
meant."""
COMMANDED = _words(
    "ref reference goal des desired cmd command commanded con target set setpoint sp qg soll"
    " sollwert consigne"
)
FILTERED = _words("filt filtered lp smooth smoothed gefiltert filtre")
MEASURED = _words("meas measured act actual msr fb feedback ist istwert mesure mesuree reel reelle")
ENABLED = _words("enable enabled servoon")
"""Words of a switch of the drive; ``servo_on`` and the like are two."""
SWITCHED = _words("servo drive motor torque power")
DRIVES = _words("motor drive servo mot moteur antrieb actuator aktor")
"""What is fed by a current: ``motor_A`` is one, ``joint_A`` is a joint."""
SOMETHING_ELSE = _words(
    "cell fric friction error err count number status state mode id isd ia ib ic iu iv iw flag"
    " limit bus supply battery imu gyro grenze fehler schleppfehler schleppabstand abweichung"
    " nummer zustand modus zwischenkreis batterie versorgung ecart erreur etat"
)
"""Words that make of a torque or a position something else."""
CONTAINERS = _words("state status")
"""Those of them that are what holds it in ``state.q``, a name within a name."""
TALLIES = _words(
    "adc dac pwm tick cycle loop step sample frame packet message msg rx tx timer sys system cpu"
    " index fifo buffer queue missed lost dropped crc zyklus takt"
)
"""Words of what is counted, or told in counts, and is no angle."""
NOISE = _words(
    "joint joints axis motor drive epos j m data value values log state states of in raw abs"
    " absolute wrapped present averaged rms arms aeff gelenk achse antrieb abtrieb wert mot moteur"
    " axe articulation de du la le en"
)
"""Words that tell nothing of which joint it is."""
JOINTS = {"huefte": "hip", "hueft": "hip", "hanche": "hip", "knie": "knee", "genou": "knee"}
"""A leg's joints, whose names exoid knows."""
SLIDES = _words("position displacement travel stroke weg hub course")
"""Words of what may be in metres; the m of ``theta_m`` is a motor's."""
TWIN = re.compile(r"#\d+$")
"""What tells columns of one name apart."""
UMLAUTS = str.maketrans(
    {"ä": "ae", "ö": "oe", "ü": "ue", "Ä": "Ae", "Ö": "Oe", "Ü": "Ue", "ß": "ss"}
)
SYMBOLS = _words("q qm th phi")
"""Of an angle, but also of an axis of a motor's current, ``i_q``."""
AXES = _words("x y z")
SIGNS = _words("n v w s f")
"""Formula signs, which are no joint's name where a unit says what they stand for: ``n (1/min)``."""
DIMENSIONS = {
    **{
        quantity: {dimension for dimension, of in QUANTITIES.items() if of == quantity}
        for quantity in WORDS
    },
    "reference": {"angle", "length", "counts"},
    "torque": {"torque", "force", "current", "voltage", "share"},
    "force": {"force", "share"},
}
"""Dimensions of the units that each quantity may be told in."""
KNOWN = frozenset().union(*WORDS.values(), COMMANDED, FILTERED, MEASURED, NOISE, SOMETHING_ELSE)


@dataclass(frozen=True)
class Meaning:
    """What a column's name says of it."""

    column: str
    quantity: str
    """One of WORDS, ``reference``, ``enabled``, or empty where the name tells nothing."""
    joint: str
    """What is left of the name: the joint's name or number."""
    unit: str | None
    commanded: bool
    filtered: bool
    measured: bool

    @property
    def rank(self) -> int:
        """How good it is as a measurement: what was measured, what may have been, what was
        filtered, commanded."""
        return 3 * self.commanded + 2 * self.filtered + (not self.measured)


def meanings(names: Iterable[str]) -> list[Meaning]:
    """Return what each name says."""
    return [meaning(name) for name in names]


def meaning(name: str) -> Meaning:
    """Return what a name says."""
    plain = TWIN.sub("", name)
    told = unit_in(plain)
    words = _split(told.rest if told else plain)
    quantity = _quantity(set(words))
    if told is not None and not (told.decides or _confirms(told, quantity, set(words))):
        told, words = None, _split(plain)
        quantity = _quantity(set(words))
    said = set(words) - _containers(plain)
    if told is not None:
        quantity = told.quantity or (quantity if told.unit else "")
        words = [word for word in words if word not in SIGNS]
    commanded = bool(said & COMMANDED)
    if said & SOMETHING_ELSE or {"i", "d"} <= said:
        quantity = ""
    elif said & ENABLED or ("on" in said and said & SWITCHED):
        quantity, words = (
            "enabled",
            [word for word in words if word not in ENABLED | SWITCHED | {"on"}],
        )
    elif commanded and quantity in ("angle", ""):
        quantity = "reference"
    unit = (
        told.unit
        if told and told.unit and UNITS[told.unit].dimension in DIMENSIONS.get(quantity, ())
        else None
    )
    return Meaning(
        name, quantity, _joint(words), unit, commanded, bool(said & FILTERED), bool(said & MEASURED)
    )


def _containers(name: str) -> set[str]:
    """Return the words of a name within a name that tell only what holds it."""
    outer, _, inner = name.replace("/", ".").rpartition(".")
    return set(_split(outer)) & CONTAINERS - set(_split(inner))


def in_counts(found: Meaning) -> Meaning | None:
    """Return a column as an angle where its name says nothing but that it is in counts; None where
    it says else."""
    told = unit_in(TWIN.sub("", found.column))
    if found.quantity or told is None or told.unit != "counts":
        return None
    words = [word for word in _split(told.rest) if word not in SIGNS]
    if set(words) & (SOMETHING_ELSE | TALLIES) or _quantity(set(words)):
        return None
    return replace(found, quantity="angle", joint=_joint(words), unit="counts")


def _joint(words: Iterable[str]) -> str:
    """Return what words leave of a name that others know all of: the joint's."""
    return "_".join(JOINTS.get(word, word) for word in words if word not in KNOWN)


def _quantity(words: set[str]) -> str:
    """Return what words say, empty where they say nothing."""
    found = [quantity for quantity, known in WORDS.items() if known & words]
    if not found:
        return ""
    # The current position is where it is now.
    proper = [quantity for quantity in found if WORDS[quantity] & words - SYMBOLS - {"current"}]
    return proper[0] if "current" in words and proper else found[0]


def _confirms(told: UnitInName, quantity: str, words: set[str]) -> bool:
    """Tell whether a letter or a word that may be a unit fits what the other words say."""
    if told.unit == "m":
        return bool(words & SLIDES)
    if told.quantity == "temperature":
        return quantity == "temperature" or "t" in words
    if told.quantity == "time":
        return quantity == "time" or (not quantity and told.unit != "s")
    if not told.quantity:
        return quantity in ("torque", "current")
    if told.quantity == "force" and "f" in words:
        return True
    if told.unit == "A" and not quantity:
        return bool(words & DRIVES)
    return told.quantity == ("angle" if words & COMMANDED and not quantity else quantity)


def _split(name: str) -> list[str]:
    """Return the words of a name in plain small letters, compounds like Motordrehzahl apart."""
    plain = BRACKETS.sub(_words_in, name).translate(UMLAUTS)
    plain = "".join(
        letter
        for letter in unicodedata.normalize("NFKD", plain)
        if not unicodedata.combining(letter)
    )
    words = re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])|\d+", plain)
    return [part for word in words for part in _apart(word.lower())]


def _words_in(bracket: re.Match[str]) -> str:
    """Return what stands in brackets where it is words, ``(hip)``, and nothing where it is a unit
    that nobody knows."""
    return (
        f" {bracket[1]} "
        if re.fullmatch(r"[^\W\d_]{3,}(\s+[^\W\d_]{3,})*|\d*", bracket[1].strip())
        else " "
    )


def _apart(word: str) -> list[str]:
    """Return the parts of a compound whose last is known, and whose first is or leaves no doubt
    about the last."""
    if word not in KNOWN and word[:-3] in SYMBOLS | AXES and word[-3:] in COMMANDED:
        return [word[:-3], word[-3:]]  # xref
    if word in KNOWN or len(word) < 6:
        return [word]
    if word.endswith("s") and word[:-1] in KNOWN:
        return [word[:-1]]
    for cut in range(2, len(word) - 2):
        head, tail = word[:cut], word[cut:]
        if tail in KNOWN and (len(tail) >= 5 or head in KNOWN):
            return [*_apart(head), tail]
    return [word]
