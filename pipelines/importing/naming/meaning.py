"""The meaning of a column's name: quantity, joint, unit, and whether it was measured."""

import re
from collections.abc import Iterable
from dataclasses import dataclass, replace

from pipelines.importing.naming.unit_in_name import (
    BRACKETS,
    QUANTITIES,
    UnitInName,
    tick_in,
    unit_in,
)
from pipelines.importing.naming.words import plain_words
from pipelines.settings.units import UNITS


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


WORDS: dict[str, frozenset[str]] = {
    quantity: _words(words)
    for quantity, words in {
        "time": "time t stamp timestamp timestamps clock zeit uhrzeit zeitstempel temps horodatage",
        "acceleration": "acc accel acceleration ddq qdd ddot dotdot beschleunigung beschl",
        "velocity": (
            "vel velo velocity speed omega dq qd qdot dot dtheta thetadot drehzahl geschwindigkeit"
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
"""Words for each quantity, English, German and French; the first that matches a name counts."""
ROTATIONS = _words("flexion extension adduction abduction rotation pronation supination tilt")
"""Words of an angle that are part of its joint's name."""
SIDES = _words("l r left right links rechts gauche droite")
"""Sides of the body, which many joints share."""
COMMANDED = _words(
    "ref reference goal des cmd command commanded con target set setpoint sp qg soll sollwert"
    " consigne demand demanded desired planned request requested trajectory vorgabe"
)
FILTERED = _words("filt filtered lp smooth smoothed gefiltert filtre")
MEASURED = _words("meas measured act actual msr fb feedback ist istwert mesure mesuree reel reelle")
ENABLED = _words("enable enabled servoon")
"""Words of a switch of the drive; ``servo_on`` and the like are two."""
SWITCHED = _words("servo drive motor torque power")
DRIVES = _words("motor drive servo mot moteur antrieb actuator aktor")
"""Words before a unit of current: ``motor_A`` is a current, ``joint_A`` a joint."""
SOMETHING_ELSE = _words(
    "cell fric friction error err count number status state mode id isd ia ib ic iu iv iw flag"
    " limit bus supply battery imu gyro grenze fehler schleppfehler schleppabstand abweichung"
    " nummer zustand modus zwischenkreis batterie versorgung ecart erreur etat"
)
"""Words that change the meaning of a torque or a position."""
DERIVED = _words(
    "delta deltas diff difference differences increment increments differenz inkrement"
    " sin cos tan sine cosine sinus cosinus kosinus"
)
"""Words of a change from row to row, or of a function of an angle."""
TALLIES = _words(
    "adc dac pwm tick cycle loop step sample frame packet message msg rx tx timer sys system cpu"
    " index fifo buffer queue missed lost dropped crc zyklus takt"
)
"""Words of quantities in counts that are no angles."""
NOISE = _words(
    "joint joints axis motor drive epos j m data value values log state states of in raw abs"
    " absolute wrapped present averaged rms arms aeff gelenk achse antrieb abtrieb wert mot moteur"
    " axe articulation de du la le en"
)
"""Words that are no part of a joint's name."""
MOTORS = _words("motor mot moteur rotor")
"""Words of what turns before a gear."""
POLES = _words("electrical elec elektrisch elektrischer electrique")
"""Words of an angle or velocity that counts a turn for each pair of a motor's poles."""
JOINTS = {"huefte": "hip", "hueft": "hip", "hanche": "hip", "knie": "knee", "genou": "knee"}
"""Translations of a leg's joints."""
RUNS = _words(
    "trial run rep repetition repeat test pass attempt versuch messung lauf wiederholung essai"
)
"""Words that distinguish runs of one machine, and no joints."""
STATISTICS = _words(
    "max maximum min minimum avg average mean median std sd stdev dev sem peak mittel mittelwert"
    " moyenne mittlere"
)
"""Words of what is kept of several samples of one quantity."""
SLIDES = _words("position displacement travel stroke weg hub course")
"""Words of positions in metres; the m of ``theta_m`` is a motor's."""
TWIN = re.compile(r"#\d+$|(?<=[\])])\.\d+$")
"""Number of columns with the same name, of exoid or, after a unit, of pandas."""
SYMBOLS = _words("q qm th phi")
"""Of an angle, but also of an axis of a motor's current, ``i_q``."""
SIGNS = _words("n v w s f")
"""Symbols that are no joint's name where a unit follows, as in ``n (1/min)``."""
DIMENSIONS = {
    **{
        quantity: {dimension for dimension, of in QUANTITIES.items() if of == quantity}
        for quantity in WORDS
    },
    "reference": {"angle", "length", "counts"},
    "torque": {"torque", "force", "current", "voltage", "share"},
    "force": {"force", "share"},
}
"""Dimensions of the units that each quantity may have."""
KNOWN = frozenset().union(
    *WORDS.values(), COMMANDED, FILTERED, MEASURED, NOISE, POLES, SOMETHING_ELSE
)


@dataclass(frozen=True)
class Meaning:
    """The meaning of a column's name."""

    column: str
    quantity: str
    """One of WORDS, ``reference``, ``enabled``, or empty where unknown."""
    joint: str
    """Name or number of the joint: the words with no other meaning."""
    unit: str | None
    commanded: bool
    filtered: bool
    measured: bool
    unread: str = ""
    """Text of a unit in the name that no map has, such as ``0.1 Nm``."""
    doubt: str = ""
    """Another meaning that the reading may have."""

    @property
    def rank(self) -> int:
        """Order of preference: measured, perhaps measured, filtered, commanded."""
        # A filter delays a signal, and a command is no measurement at all.
        return 3 * self.commanded + 2 * self.filtered + (not self.measured)


def meaning(name: str) -> Meaning:
    """Return the meaning of a name."""
    plain = TWIN.sub("", name)
    # The unit first: its letters would pass for words of the joint's name.
    in_name = unit_in(plain)
    words = words_of(in_name.rest if in_name else plain)
    quantity = _quantity(set(words))
    # A letter or a short word may be part of the name, as the A of joint_A.
    if in_name and not (in_name.decides or _confirms(in_name, quantity, set(words))):
        in_name, words = None, words_of(plain)
        quantity = _quantity(set(words))
    if in_name is None and quantity in ("", "time") and (tick := tick_in(plain)):
        in_name, words = tick, words_of(tick.rest)
        quantity = "time"
    distinct = set(words) - _containers(plain)
    unit = None
    if in_name and in_name.unread:
        quantity = quantity or in_name.quantity
    elif in_name:
        unit = in_name.unit
        # A unit that no map has overrides the words: torque in N·m/s is the rate of a torque.
        quantity = in_name.quantity or (quantity if unit else "")
        words = [word for word in words if word not in SIGNS]
    commanded = bool(distinct & COMMANDED)
    # The current i_d along the rotor's field makes no torque; i_q across it does.
    if distinct & (SOMETHING_ELSE | DERIVED) or {"i", "d"} <= distinct:
        quantity = ""
    elif distinct & ENABLED or ("on" in distinct and distinct & SWITCHED):
        quantity = "enabled"
        words = [word for word in words if word not in ENABLED | SWITCHED | {"on"}]
    # Only of an angle. A commanded torque stays a torque, as some logs have no measured one.
    elif commanded and quantity in ("angle", ""):
        quantity = "reference"
    # A unit that contradicts the words was part of the name.
    if unit and UNITS[unit].dimension not in DIMENSIONS.get(quantity, ()):
        unit = None
    return Meaning(
        name,
        quantity,
        _joint(words),
        unit,
        commanded,
        filtered=bool(distinct & FILTERED),
        measured=bool(distinct & MEASURED),
        unread=in_name.unread if in_name else "",
        doubt=_doubt(quantity, distinct, in_name.doubt if in_name and unit else ""),
    )


def _doubt(quantity: str, words: set[str], of_unit: str) -> str:
    """Return another meaning that a reading may have, by the words of its name or by its unit."""
    if quantity in ("angle", "velocity", "reference") and words & POLES:
        return "electrical, a turn for each pair of poles: set scale = 1 / pairs"
    return of_unit


def of_motor(name: str) -> bool:
    """Return whether a name says that the motor's side of a gear was measured."""
    return bool(MOTORS & set(words_of(name)))


def _containers(name: str) -> set[str]:
    """Return the words of a nested name that are only its container, as in ``state.q``."""
    outer, _, inner = name.replace("/", ".").rpartition(".")
    return set(words_of(outer)) & {"state", "status"} - set(words_of(inner))


def derived(name: str) -> bool:
    """Return whether a name says a change from row to row, or a function, of an angle."""
    # A capital D may be the fourth of several joints.
    return bool(DERIVED & set(words_of(name))) or re.match(r"d_|[Δ∆]", name) is not None


def in_counts(column: Meaning) -> Meaning | None:
    """Return a column as an angle if its name has a unit of counts and no other meaning."""
    in_name = unit_in(TWIN.sub("", column.column))
    if column.quantity or in_name is None or in_name.unit != "counts":
        return None
    words = [word for word in words_of(in_name.rest) if word not in SIGNS]
    if set(words) & (SOMETHING_ELSE | DERIVED | TALLIES) or _quantity(set(words)):
        return None
    return replace(column, quantity="angle", joint=_joint(words), unit="counts")


def _joint(words: Iterable[str]) -> str:
    """Return the words without another meaning, joined: the joint's name."""
    return "_".join(JOINTS.get(word, word) for word in words if word not in KNOWN)


def _quantity(words: set[str]) -> str:
    """Return the quantity of some words, empty where unknown."""
    quantities = [quantity for quantity, known in WORDS.items() if known & words]
    if not quantities:
        return "angle" if words & ROTATIONS else ""
    # "Current" may mean present, as in "current position".
    others = [one for one in quantities if WORDS[one] & words - SYMBOLS - {"current"}]
    return others[0] if "current" in words and others else quantities[0]


def _confirms(in_name: UnitInName, quantity: str, words: set[str]) -> bool:
    """Return whether a letter or word that may be a unit fits the other words."""
    if in_name.unit == "m":
        return bool(words & SLIDES)
    if in_name.quantity == "temperature":
        # The T of T_C is a temperature, although t alone is time.
        return quantity == "temperature" or "t" in words
    if in_name.quantity == "time":
        # A last s is often a plural or a symbol; ms, us and ns are nothing else.
        return quantity == "time" or (not quantity and in_name.unit in ("ms", "us", "100ns", "ns"))
    if not in_name.quantity:
        # Drives log a share, in %, of their rated torque or current.
        return quantity in ("torque", "current")
    if in_name.quantity == "force" and "f" in words:
        return True
    if in_name.unit == "A" and not quantity:
        return bool(words & DRIVES)
    return in_name.quantity == ("angle" if words & COMMANDED and not quantity else quantity)


def words_of(name: str) -> list[str]:
    """Return the words of a name in lower case, with compounds like Motordrehzahl split."""
    words = plain_words(BRACKETS.sub(_words_in, name))
    return [part for word in words for part in _apart(word)]


def _words_in(bracket: re.Match[str]) -> str:
    """Return the words in brackets, as in ``(hip)``; a blank for an unknown unit."""
    is_words = re.fullmatch(r"[^\W\d_]{3,}(\s+[^\W\d_]{3,})*|\d*", bracket[1].strip())
    return f" {bracket[1]} " if is_words else " "


def _apart(word: str) -> list[str]:
    """Return the parts of a compound whose last part is known, and long or after a known one."""
    if word not in KNOWN and word[:-3] in SYMBOLS | {"x", "y", "z"} and word[-3:] in COMMANDED:
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
