"""The page docs/rig-keys.md from the settings of a rig themselves; `make docs` writes it."""

from pipelines.settings.reference import HEAD, grouped_sections, rows_of
from pipelines.settings.rig import RigSettings

INTRODUCTION = """\
# Every key of a rig file

Written by `make docs` from `pipelines/settings/rig/`; change it there. [rig.md](rig.md) explains
the parts of a rig file, and [rig-file.md](rig-file.md) how to write one. `NAME` stands for a name
of your own.

## Outside of all tables
"""


def reference() -> str:
    """Return the page as Markdown."""
    own = HEAD + "\n".join(rows_of(RigSettings))
    return "\n\n".join([INTRODUCTION.rstrip(), own, *grouped_sections(RigSettings)]) + "\n"


if __name__ == "__main__":
    print(reference(), end="")
