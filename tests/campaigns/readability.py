"""How readable is the code?

``python tests/campaigns/readability.py`` measures the packages of the product by numbers that hold
for any Python code, next to those of well-known numerical projects.
"""

import ast
import io
import re
import sys
import tokenize
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median

ROOT = Path(__file__).parents[2]
PACKAGES = ("pipelines", "exoid_cli")
WIDE = 100
SECTION = re.compile(r"^\s*(?:Parameters|Returns|Yields|Raises)\n\s*-{3,}$", re.MULTILINE)
NOT_CODE = (
    tokenize.COMMENT,
    tokenize.NL,
    tokenize.NEWLINE,
    tokenize.INDENT,
    tokenize.DEDENT,
    tokenize.ENCODING,
    tokenize.ENDMARKER,
)
PROJECTS = {
    "median characters of a line of code": "26 to 35",
    "public functions with numpydoc sections, %": "pysindy 35, poliastro 54",
    "'what' in 1,000 words of docstrings": "0 to 0.4",
}
"""The same numbers of mink, lineax, diffrax, ctapipe, poliastro, MuJoCo's sysid, pysindy and
sqlite-utils, where they were measured."""


@dataclass(frozen=True)
class Module:
    """Lines, tokens and syntax tree of a source file."""

    lines: list[str]
    tokens: list[tokenize.TokenInfo]
    tree: ast.Module

    @classmethod
    def parse(cls, source: str) -> "Module":
        tokens = list(tokenize.generate_tokens(io.StringIO(source).readline))
        return cls(source.splitlines(), tokens, ast.parse(source))

    def comments(self) -> list[str]:
        return [token.string for token in self.tokens if token.type == tokenize.COMMENT]

    def docstrings(self) -> list[tuple[str, range]]:
        """Return each string that stands alone, with its lines."""
        return [
            (node.value.value, range(node.lineno, (node.end_lineno or node.lineno) + 1))
            for node in ast.walk(self.tree)
            if isinstance(node, ast.Expr)
            and isinstance(node.value, ast.Constant)
            and isinstance(node.value.value, str)
        ]

    def code(self) -> list[str]:
        """Return the lines of code without their indentation, docstrings and comments."""
        prose = {number for _, lines in self.docstrings() for number in lines}
        numbers = {
            number
            for token in self.tokens
            if token.type not in NOT_CODE
            for number in range(token.start[0], token.end[0] + 1)
        }
        return [self.lines[number - 1].strip() for number in sorted(numbers - prose)]

    def public_functions(self) -> list[ast.FunctionDef | ast.AsyncFunctionDef]:
        """Return functions of the module and methods of its classes whose names are public."""
        scopes = [self.tree, *(node for node in self.tree.body if isinstance(node, ast.ClassDef))]
        return [
            node
            for scope in scopes
            for node in scope.body
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
            and not node.name.startswith("_")
        ]

    def constants(self) -> list[str]:
        """Return the names in capitals that the module assigns."""
        names = [
            target.id
            for node in self.tree.body
            if isinstance(node, ast.Assign | ast.AnnAssign)
            for assigned in (node.targets if isinstance(node, ast.Assign) else [node.target])
            for target in ast.walk(assigned)
            if isinstance(target, ast.Name)
        ]
        return [name for name in names if name.isupper()]


def measure(modules: Sequence[Module]) -> dict[str, float]:
    """Return each number by its name."""
    lines = [line for module in modules for line in module.lines]
    functions = [function for module in modules for function in module.public_functions()]
    documented = [node for node in functions if SECTION.search(ast.get_docstring(node) or "")]
    words = [
        word
        for module in modules
        for text, _ in module.docstrings()
        for word in re.findall(r"[a-z]+", text.lower())
    ]
    comments = [comment for module in modules for comment in module.comments()]
    constants = [name for module in modules for name in module.constants()]
    walruses = [
        node
        for module in modules
        for node in ast.walk(module.tree)
        if isinstance(node, ast.NamedExpr)
    ]
    wide = [line for line in lines if len(line) > WIDE]
    code = [line for module in modules for line in module.code()]
    return {
        "lines": len(lines),
        "median characters of a line of code": median(map(len, code)),
        f"lines of more than {WIDE} columns, %": 100 * len(wide) / len(lines),
        "public functions with numpydoc sections, %": 100 * len(documented) / len(functions),
        "comments in 100 lines": 100 * len(comments) / len(lines),
        "constants of modules in 100 lines": 100 * len(constants) / len(lines),
        "'what' in 1,000 words of docstrings": 1000 * words.count("what") / len(words),
        "lines that the formatter skips": sum("fmt: " in comment for comment in comments),
        "assignment expressions": len(walruses),
    }


def main(folders: Sequence[Path]) -> None:
    """Print a table of the numbers of all Python files in folders."""
    paths = [path for folder in folders for path in sorted(folder.rglob("*.py"))]
    values = measure([Module.parse(path.read_text(encoding="utf-8")) for path in paths])
    width = max(map(len, values))
    print(f"{'':{width}}  {'here':>8}  other projects")
    for name, value in values.items():
        print(f"{name:{width}}  {value:8.1f}  {PROJECTS.get(name, '')}".rstrip())


if __name__ == "__main__":
    main([Path(folder) for folder in sys.argv[1:]] or [ROOT / package for package in PACKAGES])
