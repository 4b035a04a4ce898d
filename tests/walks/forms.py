"""Forms of pages as a browser without scripts sees them: what is in them is sent, some of it chosen otherwise."""

import random
from dataclasses import dataclass, field
from html.parser import HTMLParser

WORDS = ("Looked at", "New insert", "0.002", "-0,004", "40.003", "5", "0")
NUMBERS = ("0", "0.002", "-0.004", "40.002", "1", "3", "40,001")


@dataclass
class Form:
    """Where it is sent, and what its fields may be: the chosen value first."""

    action: str
    fields: list[tuple[str, list[str]]] = field(default_factory=list)
    buttons: list[tuple[str, str]] = field(default_factory=list)
    radios: dict[str, list[str]] = field(default_factory=dict)
    files: bool = False

    def filled(self, chance: random.Random) -> dict[str, str | list[str]]:
        """As somebody fills it: most as it is, what is empty with something, a choice at random."""
        sent: dict[str, str | list[str]] = {}
        for name, values in self.fields:
            value = values[0] if chance.random() < 0.6 else chance.choice(values)
            if value == LEFT_OUT:
                continue
            if name in sent:
                earlier = sent[name]
                sent[name] = [*(earlier if isinstance(earlier, list) else [earlier]), value]
            else:
                sent[name] = value
        for name, values in self.radios.items():
            sent[name] = values[0] if chance.random() < 0.5 else chance.choice(values)
        if self.buttons:
            name, value = chance.choice(self.buttons)
            sent[name] = value
        return sent


LEFT_OUT = "\0"


class _Reader(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.forms: list[Form] = []
        self.form: Form | None = None
        self.select: tuple[str, list[str]] | None = None
        self.area: tuple[str, list[str]] | None = None

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        given = {name: value or "" for name, value in attributes}
        name = given.get("name", "")
        if tag == "form":
            self.form = Form(given.get("action", "")) if given.get("method", "").lower() == "post" else None
            if self.form is not None:
                self.forms.append(self.form)
        form = self.form
        if form is None:
            return
        if tag == "option" and self.select is not None:
            at = 0 if "selected" in given else len(self.select[1])
            self.select[1].insert(at, given.get("value", ""))
        elif "disabled" in given or not name:
            return
        elif tag == "input":
            self._input(form, name, given)
        elif tag == "button" and given.get("type", "submit") == "submit":
            form.buttons.append((name, given.get("value", "")))
        elif tag == "select":
            self.select = (name, [])
        elif tag == "textarea":
            self.area = (name, [""])

    def _input(self, form: Form, name: str, given: dict[str, str]) -> None:
        kind, value = given.get("type", "text"), given.get("value", "")
        if kind == "file":
            form.files = True
        elif kind == "radio":
            of_name = form.radios.setdefault(name, [])
            of_name.insert(0 if "checked" in given else len(of_name), value)
        elif kind == "checkbox":
            chosen = [value or "on", LEFT_OUT]
            form.fields.append((name, chosen if "checked" in given else chosen[::-1]))
        elif kind == "hidden":
            form.fields.append((name, [value]))
        else:
            numeric = kind == "number" or given.get("inputmode") in {"decimal", "numeric"}
            other = NUMBERS if numeric else WORDS
            form.fields.append((name, [value or other[0], value, *other]))

    def handle_data(self, data: str) -> None:
        if self.area is not None:
            self.area[1][0] += data

    def handle_endtag(self, tag: str) -> None:
        if tag == "form":
            self.form = None
        elif tag == "select" and self.select is not None and self.form is not None:
            if self.select[1]:
                self.form.fields.append(self.select)
            self.select = None
        elif tag == "textarea" and self.area is not None and self.form is not None:
            name, (text,) = self.area
            self.form.fields.append((name, [text.strip() or WORDS[0], *WORDS]))
            self.area = None


def forms(html: str) -> list[Form]:
    """The forms of a page that change something."""
    reader = _Reader()
    reader.feed(html)
    return [form for form in reader.forms if not form.files]
