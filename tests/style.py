"""Style that no linter knows: lengths of `app/` that may only shrink, summaries that are no questions, width of templates.

For `make lint`.
"""

import ast
import sys
from pathlib import Path

LONGEST_FUNCTION = 88  # lines, from `def` to the end, docstring included
LONGEST_FILE = 519
QUESTIONS = {"What", "Whether", "How", "Which", "Who", "Whose", "Where", "When", "Why"}
WIDEST_TEMPLATE = 160  # columns
APP = Path(__file__).resolve().parents[1] / "app"
TEMPLATES = APP.parent / "frontend" / "templates"


def main() -> int:
    """Print what breaks the style, and a cap that could be lower; return the exit status."""
    files = {path: path.read_text(encoding="utf-8") for path in APP.rglob("*.py")}
    functions = {
        f"{path.relative_to(APP.parent)}:{node.lineno} {node.name}": (node.end_lineno or 0) - node.lineno + 1
        for path, text in files.items()
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
    }
    lengths = {str(path.relative_to(APP.parent)): text.count("\n") for path, text in files.items()}
    status = 0
    for kind, cap, measured in (("function", LONGEST_FUNCTION, functions), ("file", LONGEST_FILE, lengths)):
        for name, lines in measured.items():
            if lines > cap:
                sys.stderr.write(f"{name}: {lines} lines; no {kind} of app/ is longer than {cap}. Divide it.\n")
                status = 1
        if max(measured.values()) < cap:
            sys.stderr.write(
                f"The longest {kind} has {max(measured.values())} lines: lower the cap in tests/style.py.\n"
            )
            status = 1
    for path, text in files.items():
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef | ast.Module):
                words = (ast.get_docstring(node) or "-").split()
                if words[0].rstrip(".,:'s") in QUESTIONS or words[0] in QUESTIONS:
                    place = f"{path.relative_to(APP.parent)}:{getattr(node, 'lineno', 1)}"
                    sys.stderr.write(
                        f"{place}: a summary is no question ({words[0]} …): name the thing, or say what it does.\n"
                    )
                    status = 1
    for template in TEMPLATES.rglob("*.html"):
        for number, line in enumerate(template.read_text(encoding="utf-8").splitlines(), 1):
            if len(line) > WIDEST_TEMPLATE:
                place = f"{template.relative_to(APP.parent)}:{number}"
                sys.stderr.write(
                    f"{place}: {len(line)} columns; no line of a template is wider than {WIDEST_TEMPLATE}.\n"
                )
                status = 1
    return status


if __name__ == "__main__":
    sys.exit(main())
