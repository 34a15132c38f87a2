"""Settings from TOML files: typed and frozen, with errors in one line that name the key."""

import json
import tomllib
from collections import Counter
from collections.abc import Hashable, Iterable, Iterator
from pathlib import Path
from typing import Annotated, Any, Self, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from pipelines.errors import SettingsError
from pipelines.validation.explain import explain
from pipelines.validation.suggestion import similar_file
from pipelines.validation.toml import read_toml

Positive = Annotated[float, Field(gt=0.0)]
NotNegative = Annotated[float, Field(ge=0.0)]

Gravity = Annotated[float, Field(ge=0.0, le=30.0)]
"""In m/s², up to more than on any planet; 9.81 m/s² in cm/s² is beyond it."""
Length = Annotated[float, Field(gt=0.0, le=5.0)]
"""In m, up to more than any limb or machine for one; 389.52 mm and 38.952 cm are beyond it."""


class Settings(BaseModel):
    """One table of a settings file; every field has a description, and its unit in its name."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    def changed(self, **values: Any) -> Self:
        """Return the settings with the values replaced that are not None.

        Raises
        ------
        SettingsError
            If the result is not valid.
        """
        # Validated as a whole again, which `model_copy` does not do.
        content = self.model_dump() | {
            name: value for name, value in values.items() if value is not None
        }
        try:
            return type(self).model_validate(content)
        except ValidationError as error:
            raise SettingsError(explain(error, content)) from error


Model = TypeVar("Model", bound=Settings)


def load_toml(path: Path | str, model: type[Model]) -> Model:
    """Return the settings in a TOML file.

    Raises
    ------
    SettingsError
        If the file or a value is not valid, with file, key and remedy.
    """
    path = Path(path)
    content = _content(path)
    try:
        # Strict validation of JSON has the types of TOML: "5" is no number, but [1, 2] is a tuple.
        return model.model_validate_json(json.dumps(content, default=str), strict=True)
    except ValidationError as error:
        raise SettingsError(
            f"{path}: {explain(error, content, lambda key: _keys_at(model, key))}"
        ) from error


def _content(path: Path) -> dict[str, Any]:
    if not path.exists():
        raise SettingsError(
            f"{path}: no such file;"
            f" {similar_file(path) or '`exoid init DIR` writes a commented one to start from'}"
        )
    if path.is_dir():
        raise SettingsError(f"{path}: is a folder, expected a TOML file; name the file in it")
    try:
        return read_toml(path)
    except tomllib.TOMLDecodeError as error:
        raise SettingsError(f"{path}: is not valid TOML: {error}; correct that line") from error
    except UnicodeDecodeError as error:
        raise SettingsError(
            f"{path}: is not UTF-8 text, expected a TOML file; save it as UTF-8"
        ) from error


def _keys_at(model: type[BaseModel], path: str) -> list[str]:
    """Return the keys that the table at a dotted path (``design.bounds``, ``run[0]``) may have."""
    for part in path.split(".") if path else []:
        field = model.model_fields.get(part.split("[")[0])
        inner = next(models_in(field.annotation), None) if field else None
        if inner is None:
            return []
        model = inner
    return list(model.model_fields)


Item = TypeVar("Item", bound=Hashable)


def repeated(items: Iterable[Item]) -> list[Item]:
    """Return the items that occur more than once."""
    return [item for item, times in Counter(items).items() if times > 1]


def models_in(annotation: Any) -> Iterator[type[BaseModel]]:
    """Yield the models in a field's type: Run for ``tuple[Run, ...] | None``."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for argument in get_args(annotation):
        yield from models_in(argument)
