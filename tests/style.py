"""Style that no linter knows: lengths of `app/` that may only shrink, summaries that are no questions, width of templates,
words, sentences that can be translated.

For `make lint`.
"""

import ast
import io
import re
import sys
import tokenize
from collections.abc import Iterable, Iterator
from pathlib import Path

LONGEST_FUNCTION = 80  # lines, from `def` to the end, docstring included
LONGEST_FILE = 519
QUESTIONS = {"What", "Whether", "How", "Which", "Who", "Whose", "Where", "When", "Why"}
WIDEST_TEMPLATE = 160  # columns
NOT_SAID = re.compile(
    r"\b(told(?![:(),]| IS| -)|mend(?:s|ed|ing)?|anew|whoever|so many(?! that)|nobody has said|(?:is|are|was|were|be) away)\b",
    re.IGNORECASE,
)
"""Say reported, found or informed; fix; again; the user or anyone who; the number or N; not entered; unreachable."""
NOT_NAMED = {"anew", "mended", "whoever"}
CODE = re.compile(
    r"``.*?``|`[^`]*`|\]\([^)]*\)|^ *>>>.*$|\b(?:SELECT|UPDATE|INSERT|CREATE TABLE|DELETE FROM)\b.*",
    re.DOTALL | re.MULTILINE,
)
SENTENCE = re.compile(r"_\(\"(.*?)\"", re.DOTALL)
APP = Path(__file__).resolve().parents[1] / "app"
TEMPLATES = APP.parent / "frontend" / "templates"
DOCS = APP.parent / "docs"


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
                if words[0].rstrip(".,:'s") in QUESTIONS or words[0].startswith("How-"):
                    place = f"{path.relative_to(APP.parent)}:{getattr(node, 'lineno', 1)}"
                    sys.stderr.write(
                        f"{place}: a summary is no question ({words[0]} …): name the thing, or say what it does.\n"
                    )
                    status = 1
    for place in hidden_sentences(files):
        sys.stderr.write(f"{place}: pybabel does not see a sentence inside an f-string: put it beside.\n")
        status = 1
    for place, word in sorted([*words_not_said(files), *names_not_given(files)]):
        sys.stderr.write(f"{place}: “{word}” is not said here; see NOT_SAID in tests/style.py.\n")
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


def hidden_sentences(files: dict[Path, str]) -> Iterator[str]:
    """Places of `_()` inside f-strings, where no catalogue of translations gets them."""
    for path, text in files.items():
        for written in ast.walk(ast.parse(text)):
            if isinstance(written, ast.JoinedStr) and any(map(_is_sentence, ast.walk(written))):
                yield f"{path.relative_to(APP.parent)}:{written.lineno}"


def _is_sentence(node: ast.AST) -> bool:
    return isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in {"_", "ngettext"}


def words_not_said(files: dict[Path, str]) -> Iterator[tuple[str, str]]:
    """Words that are not ours in sentences, docstrings, comments and documents, each with its place."""
    for path, text in files.items():
        tokens = tokenize.generate_tokens(io.StringIO(text).readline)
        texts = [
            (token.start[0], token.string)
            for token in tokens
            if token.type == tokenize.COMMENT or (token.type == tokenize.STRING and " " in token.string)
        ]
        yield from _found(path, texts)
    for path in TEMPLATES.rglob("*.html"):
        text = path.read_text(encoding="utf-8")
        yield from _found(path, [(text.count("\n", 0, at.start()) + 1, at[1]) for at in SENTENCE.finditer(text)])
    for path in (*DOCS.rglob("*.md"), *DOCS.parent.glob("*.md")):
        yield from _found(path, [(1, re.sub(r"```.*?```", "", path.read_text(encoding="utf-8"), flags=re.DOTALL))])


def names_not_given(files: dict[Path, str]) -> Iterator[tuple[str, str]]:
    """Names of functions, arguments and variables of the program, and of tests, with words that are not ours."""
    tests = {path: path.read_text(encoding="utf-8") for path in Path(__file__).parent.rglob("test_*.py")}
    for path, text in (files | tests).items():
        named = r"\bdef (test_\w+)" if path in tests else r"\b(\w+)(?==| =|\()|def (\w+)"
        for at in re.finditer(named, text):
            if not NOT_NAMED.isdisjoint(at[0].split("_")):
                yield f"{path.relative_to(APP.parent)}:{text.count(chr(10), 0, at.start()) + 1}", at[0]


def _found(path: Path, texts: Iterable[tuple[int, str]]) -> Iterator[tuple[str, str]]:
    for number, text in texts:
        for word in NOT_SAID.findall(CODE.sub("", text)):
            yield f"{path.relative_to(APP.parent)}:{number}", word


if __name__ == "__main__":
    sys.exit(main())
