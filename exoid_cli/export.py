"""``exoid export``: write an identified model in a format that another tool reads."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from exoid_cli import completion
from exoid_cli.console import console
from exoid_cli.experiment_folder import open_experiment, settings_in_force
from exoid_cli.options import ConfigOption, files_argument

if TYPE_CHECKING:
    from pipelines.export import ExportedModel, Format


def export(
    model: Annotated[
        Path | None, files_argument("A parameters/1 file.", "identified/parameters.parquet")
    ] = None,
    *,
    to: Annotated[
        str, typer.Option(help="mjcf, urdf, json, matlab or c.", autocompletion=completion.formats)
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", help="The file, or a folder for it; next to the model unless given."
        ),
    ] = None,
    run: Annotated[
        str | None,
        typer.Option(help="exo_alone, with_human or human; with_human if there are several."),
    ] = None,
    config: ConfigOption = None,
) -> None:
    """Export an identified model to MuJoCo, pinocchio, MATLAB, C or JSON.

    \b
    Examples:
      exoid export --to urdf
      exoid export diagnosed/parameters.parquet --to mjcf -o leg.xml
    """
    from pipelines.contracts import PARAMETERS
    from pipelines.contracts.atomic import write_text
    from pipelines.errors import SettingsError
    from pipelines.export import FORMATS, exported
    from pipelines.mechanics.read import geometry_from
    from pipelines.validation.suggestion import suggestion

    formats = {format.name: format for format in FORMATS}
    if to not in formats:
        raise SettingsError(f"--to {to}: there is no such format; {suggestion(to, list(formats))}")
    chosen = formats[to]
    model = model or open_experiment(config, problem="no model is given").step("identify").target
    settings = settings_in_force(config)
    model_to_write = exported(PARAMETERS.read(model), run, geometry_from(settings))
    path = _path(model, output, chosen)
    with console.working("writing the model"):
        files = _texts(model_to_write, chosen, path)
    if any(file.resolve() == model.resolve() for file in files):
        raise SettingsError(f"-o {path}: is the model itself; choose another file")
    for file, text in files.items():
        write_text(file, text)
    _report(model_to_write, chosen, list(files))


def _path(model: Path, output: Path | None, chosen: "Format[ExportedModel]") -> Path:
    """Return the file to write: ``output``, a file in that folder, or one next to the model."""
    from pipelines.errors import SettingsError
    from pipelines.export import FORMATS

    if output is None:
        return model.with_suffix(chosen.suffix)
    is_file = output.suffix and not output.is_dir()
    path = output if is_file else output / f"{model.stem}{chosen.suffix}"
    for other in FORMATS:
        # A mistaken suffix would be opened by the wrong program, so it is refused.
        if other.suffix == path.suffix != chosen.suffix:
            raise SettingsError(
                f"-o {path}: is a file name of --to {other.name}, expected {chosen.suffix} with"
                f" --to {chosen.name}"
            )
    return path


def _texts(
    exported: "ExportedModel", chosen: "Format[ExportedModel]", path: Path
) -> dict[Path, str]:
    """Return the content of each file; the main one is ``path``, whatever its suffix."""
    files = {
        path.with_suffix(suffix): text for suffix, text in chosen.write(exported, path.stem).items()
    }
    # A suffix of the user's own, such as .mjcf, is kept for the main file.
    if path.suffix not in {file.suffix for file in files}:
        files[path] = files.pop(path.with_suffix(chosen.suffix))
    return files


def _report(exported: "ExportedModel", chosen: "Format[ExportedModel]", files: list[Path]) -> None:
    from pipelines.export import Degree
    from pipelines.export.exported import values_in_words

    holdings = exported.holdings(chosen)
    terms = []
    for term, holding in holdings:
        physical = term.effect.physical(term.values)
        named = zip(term.effect.parameters, physical, strict=True)
        values = {p.name: {"value": float(value), "unit": p.unit} for p, value in named}
        about = {"term": term.effect.label, "held": holding.degree.value, "how": holding.how}
        terms.append(about | {"parameters": values})
    written = [str(file) for file in files]
    result = {"to": chosen.name, "run": exported.run, "files": written}
    console.emit(result | {"warnings": exported.friction_warnings(), "terms": terms})
    rows = [(term.effect.label, holding.degree, holding.how) for term, holding in holdings]
    console.table(("term", "in the file", "how"), rows)
    for sentence in exported.friction_warnings():
        console.warn(sentence)
    for term, holding in holdings:
        if holding.degree is Degree.NOT:
            console.warn(
                f"{term.effect.label} is not in the file ({holding.how}): {values_in_words(term)}"
            )
    console.say(f"{', '.join(written)}: the {exported.run} model")
