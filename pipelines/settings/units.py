"""Units of logs and registers, and their conversion to SI."""

from dataclasses import dataclass
from math import pi


@dataclass(frozen=True)
class Unit:
    """A unit: SI value = factor x reading + offset."""

    dimension: str
    factor: float
    offset: float = 0.0


# Inch (0.0254 m), pound-force and kilogram-force are exact by definition.
UNITS: dict[str, Unit] = {
    "s": Unit("time", 1.0),
    "ms": Unit("time", 1e-3),
    "us": Unit("time", 1e-6),
    "100ns": Unit("time", 1e-7),
    "ns": Unit("time", 1e-9),
    "min": Unit("time", 60.0),
    "h": Unit("time", 3600.0),
    "d": Unit("time", 86400.0),
    # Dates are read as whole nanoseconds.
    "iso8601": Unit("time", 1e-9),
    "rad": Unit("angle", 1.0),
    "mrad": Unit("angle", 1e-3),
    "deg": Unit("angle", pi / 180.0),
    "rev": Unit("angle", 2.0 * pi),
    "m": Unit("length", 1.0),
    "cm": Unit("length", 1e-2),
    "mm": Unit("length", 1e-3),
    "um": Unit("length", 1e-6),
    "in": Unit("length", 0.0254),
    "counts": Unit("counts", 1.0),
    "counts/s": Unit("counts per second", 1.0),
    "rad/s": Unit("angular velocity", 1.0),
    "mrad/s": Unit("angular velocity", 1e-3),
    "deg/s": Unit("angular velocity", pi / 180.0),
    "rev/s": Unit("angular velocity", 2.0 * pi),
    "rpm": Unit("angular velocity", 2.0 * pi / 60.0),
    "m/s": Unit("velocity", 1.0),
    "cm/s": Unit("velocity", 1e-2),
    "mm/s": Unit("velocity", 1e-3),
    "in/s": Unit("velocity", 0.0254),
    "N·m": Unit("torque", 1.0),
    "mN·m": Unit("torque", 1e-3),
    "N·cm": Unit("torque", 1e-2),
    "kN·m": Unit("torque", 1e3),
    "kgf·cm": Unit("torque", 0.01 * 9.80665),
    "lbf·in": Unit("torque", 0.0254 * 4.4482216152605),
    "lbf·ft": Unit("torque", 12.0 * 0.0254 * 4.4482216152605),
    "N": Unit("force", 1.0),
    "mN": Unit("force", 1e-3),
    "kN": Unit("force", 1e3),
    "kgf": Unit("force", 9.80665),
    "lbf": Unit("force", 4.4482216152605),
    "A": Unit("current", 1.0),
    "mA": Unit("current", 1e-3),
    "V": Unit("voltage", 1.0),
    "mV": Unit("voltage", 1e-3),
    "%": Unit("share", 1e-2),
    "permille": Unit("share", 1e-3),
    "°C": Unit("temperature", 1.0),
    "K": Unit("temperature", 1.0, -273.15),
    "°F": Unit("temperature", 5.0 / 9.0, -160.0 / 9.0),
}

ALIASES = {
    alias: unit
    for unit, aliases in {
        "s": ("sec", "seconds"),
        "ms": ("msec",),
        # The micro sign and the Greek letter look alike, but are two characters.
        "us": ("usec", "µs", "μs"),
        "min": ("minutes",),
        "h": ("hours",),
        "d": ("days",),
        "deg": ("°", "degree", "degrees", "Grad"),
        "rad": ("radians",),
        "rev": ("turn", "turns"),
        "counts": (
            "count",
            "cnt",
            "cts",
            "ticks",
            "inc",
            "Inkr",
            "Inkr.",
            "Inkremente",
            "points",
            "pts",
            "pulses",
            "Impulse",
            "impulsions",
        ),
        "counts/s": ("counts/sec", "cnt/s", "ticks/s", "inc/s", "Inkr/s", "Inkr./s"),
        "rev/s": ("rps", "U/s", "tr/s"),
        "rpm": ("RPM", "1/min", "min^-1", "min-1", "min⁻¹", "U/min", "tr/min", "rev/min"),
        "rad/s": ("rad/sec", "radps"),
        "deg/s": ("°/s", "°/sec", "deg/sec", "Grad/s", "dps"),
        "mm/s": ("mm/sec",),
        "N·m": ("Nm", "N*m", "N.m", "N m"),
        "mN·m": ("mNm", "mN*m", "mN.m", "Nmm", "N·mm", "N*mm", "N.mm", "N mm"),
        "N·cm": ("Ncm", "N*cm", "N.cm", "N cm"),
        "kN·m": ("kNm",),
        "kgf·cm": ("kgf*cm",),
        "lbf·in": ("in-lb", "in-lbs", "in-lbf", "lb-in", "lbf-in"),
        "lbf·ft": ("ft-lb", "ft-lbs", "ft-lbf", "lb-ft", "lbf-ft"),
        "A": ("amps", "ampere"),
        "V": ("volts", "volt"),
        "N": ("newton",),
        "°C": ("degC", "deg C", "Grad C", "C", "celsius"),
        "°F": ("degF",),
        "%": ("pct", "percent"),
        "permille": ("‰", "0/00"),
        "um": ("µm", "μm"),
    }.items()
    for alias in aliases
}
"""Unit of each other spelling."""


def unit_named(name: str) -> Unit | None:
    """Return the unit with a name or alias, if any."""
    return UNITS.get(ALIASES.get(name, name))


def units_of(*dimensions: str) -> list[str]:
    """Return the names of all units of some dimensions."""
    return [name for name, unit in UNITS.items() if unit.dimension in dimensions]
