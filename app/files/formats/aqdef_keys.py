"""Keys of the values of AQDEF files: the same value has the same one, in whatever file and however written it comes."""

import hashlib
from collections import Counter
from datetime import datetime

from app.files.formats.aqdef_values import Value

_WHO = ("K0014", "K0006", "K0053", "K0007")


class Keys:
    """The keys of one file. Values that are alike in everything are counted, wherever in the file they stand."""

    def __init__(self) -> None:
        self._seen: set[int] = set()  # 8 bytes of each name: a file has millions
        self._again: Counter[int] = Counter()

    def of(self, value: Value, identity: tuple[str, str, str], measured: float, at: datetime) -> str:
        """The key of a value. identity: part, number and name of its characteristic. measured: mm. at: as the file has it."""
        fields = {name: value.fields.get(name, "") for name in _WHO}
        if not fields["K0007"].strip("0"):  # some programs write every field, others none that says nothing
            fields["K0007"] = ""
        text = "|".join([*identity, repr(round(measured, 9)), at.isoformat(), *fields.values()])
        name = hashlib.blake2b(text.encode(), digest_size=10)
        short = int.from_bytes(name.digest()[:8])
        if short in self._seen:
            self._again[short] += 1
        self._seen.add(short)
        return f"aqdef:{name.hexdigest()}:{self._again[short] + 1}"
