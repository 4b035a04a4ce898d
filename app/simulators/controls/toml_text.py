"""The table of a simulated control, as a bridge's configuration has it."""


def toml_of(key: str, table: dict[str, object]) -> str:
    """A machine's table in TOML: plain values first, then tables in it."""
    lines: list[str] = []

    def write(place: str, content: dict[str, object], *, head: str) -> None:
        inner = {}
        start = len(lines)
        for name, value in content.items():
            if isinstance(value, dict) or (isinstance(value, list) and value and isinstance(value[0], dict)):
                inner[name] = value
            else:
                lines.append(f"{name} = {_toml_value(value)}")
        if len(lines) > start or not inner:
            lines.insert(start, head)
        for name, value in inner.items():
            if isinstance(value, dict):
                write(f"{place}.{name}", value, head=f"\n[{place}.{name}]")
            else:
                for each in value:
                    write(f"{place}.{name}", each, head=f"\n[[{place}.{name}]]")

    write(f"machine.{key}", table, head=f"[machine.{key}]")
    return "\n".join(lines)


def _toml_value(value: object) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int | float):
        return repr(value)
    if isinstance(value, list):
        return f"[{', '.join(_toml_value(each) for each in value)}]"
    return '"' + str(value).replace("\\", "\\\\").replace('"', '\\"') + '"'
