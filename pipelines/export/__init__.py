"""Export of identified models to the formats of other tools, one file per format."""

from pipelines.export.c import C
from pipelines.export.exported import ExportedModel, exported
from pipelines.export.format import Degree, Format, Holding
from pipelines.export.json_document import JSON
from pipelines.export.matlab import MATLAB
from pipelines.export.mjcf import MJCF
from pipelines.export.urdf import URDF

FORMATS: tuple[Format[ExportedModel], ...] = (MJCF, URDF, JSON, MATLAB, C)

__all__ = ["FORMATS", "Degree", "ExportedModel", "Format", "Holding", "exported"]
