"""Look up everything that constraints.txt names in a database of known vulnerabilities, and say plainly what was not judged.

Ends with 1 where something is known, with 2 where nothing could be judged: no answer is no clean bill.
"""

import json
import re
import subprocess
import sys


def main() -> int:
    command = [
        sys.executable,
        "-m",
        "pip_audit",
        "--disable-pip",
        "--require-hashes",
        "--progress-spinner=off",
        "-f",
        "json",
    ]
    ran = subprocess.run([*command, "-r", "constraints.txt"], check=False, capture_output=True, text=True)
    try:
        found = json.loads(ran.stdout)["dependencies"]
    except (ValueError, KeyError, TypeError):
        print(f"Not judged: {_why_not(ran.stderr)}")
        return 2
    known = [(each["name"], each["version"], bug) for each in found for bug in each.get("vulns", ())]
    for name, version, bug in known:
        print(f"{name} {version}: {bug['id']}, corrected in {', '.join(bug['fix_versions']) or 'no version yet'}")
    unknown = [each["name"] for each in found if "skip_reason" in each]
    if len(unknown) == len(found):
        print(f"Not judged: the database that was reached knows none of the {len(found)} libraries.")
        return 2
    if unknown:
        print(f"Not judged, {len(unknown)} of {len(found)}, which the database does not know: {', '.join(unknown)}")
    print(f"{len(found) - len(unknown)} judged, {len(known)} known vulnerabilities. PostgreSQL itself: inband check")
    return 1 if known else 0


def _why_not(stderr: str) -> str:
    """One sentence on why pip-audit gave no answer."""
    last = " ".join((stderr.strip().splitlines() or ["it says nothing"])[-1].split())[:200]
    if re.search(r"connect|resol|timed? ?out|retries|unreachable|proxy|ServiceError", stderr, re.IGNORECASE):
        return (
            "no database of known vulnerabilities can be reached from here, so nothing is known of any library; "
            f"run make audit where one can be reached ({last})."
        )
    return f"pip-audit, which looks the libraries up, has failed ({last})."


if __name__ == "__main__":
    sys.exit(main())
