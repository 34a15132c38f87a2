"""Upper bounds that find a length or a gravity in a wrong unit."""

from typing import Annotated

from pydantic import Field

Gravity = Annotated[float, Field(ge=0.0, le=30.0)]
"""In m/s², up to more than on any planet; 9.81 m/s² in cm/s² is beyond it."""

Length = Annotated[float, Field(gt=0.0, le=5.0)]
"""In m, up to more than any limb or machine for one; 389.52 mm and 38.952 cm are beyond it."""
