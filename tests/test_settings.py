import re
from pathlib import Path

import pytest
from pydantic import ValidationError

from app.cli.base import SERVED, as_served, remember_address
from app.settings import Settings


def test_from_the_environment(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("INBAND_PORT", "9000")
    monkeypatch.setenv("INBAND_DATA_DIR", str(tmp_path))
    monkeypatch.setenv("INBAND_PUBLIC_URL", "")
    assert (Settings().port, Settings().data_dir, Settings().public_url) == (9000, tmp_path, None)
    assert Settings(port=9001).port == 9001


def test_the_data_folder_follows_xdg(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    assert Settings().data_dir == tmp_path / "inband"


def test_every_field_is_described() -> None:
    assert [name for name, field in Settings.model_fields.items() if not field.description] == []


def test_listening_to_the_network_needs_https_or_a_decision() -> None:
    with pytest.raises(ValidationError, match="INBAND_ALLOW_PLAIN_HTTP"):
        Settings(host="192.0.2.1")
    with pytest.raises(ValidationError, match="INBAND_ALLOW_PLAIN_HTTP"):
        Settings(host="0.0.0.0", public_url="http://inband.example")
    behind_a_proxy = Settings(host="0.0.0.0", public_url="https://inband.example/")
    assert behind_a_proxy.secure_cookies
    assert behind_a_proxy.address == "https://inband.example"
    closed_network = Settings(host="0.0.0.0", allow_plain_http=True)
    assert not closed_network.secure_cookies
    assert closed_network.address == "http://127.0.0.1:8000"
    assert Settings(host="::1").address == "http://[::1]:8000"


def test_a_password_in_an_address_is_never_repeated() -> None:
    with pytest.raises(ValidationError) as refused:
        Settings(database_url="postgresql://me:hunter2@db.example")
    assert "hunter2" not in str(refused.value)
    assert "hunter2" not in repr(Settings(database_url="postgresql://me:hunter2@db.example/inband"))


@pytest.mark.parametrize("password", ["sec@ret", "77/88", "77@88@99", "77#88", "pqr/stu@vwx"])
def test_an_at_or_slash_in_a_password_is_refused_and_not_repeated(password: str) -> None:
    """libpq would take the rest for the host, and name it in its error."""
    with pytest.raises(ValidationError, match=r"%40|well-formed|names no database") as refused:
        Settings(database_url=f"postgresql://me:{password}@127.0.0.1:5432/inband")
    assert not [part for part in re.split("[@/#]", password) if part in str(refused.value)]
    assert Settings(database_url="postgresql://me:sec%40ret@127.0.0.1:5432/inband").database_url


@pytest.mark.parametrize(
    "url",
    [
        "postgresql://u:p@a:5432,b:5432/db",
        "postgresql://u:p@[::1]:5432/db",
        "postgresql://inband@/inband?host=/srv/inband/run&port=5432",
        "postgresql+psycopg://u@a,b/db?target_session_attrs=any",
    ],
)
def test_an_address_may_be_what_postgresql_understands(url: str) -> None:
    assert Settings(database_url=url).database_url == url


@pytest.mark.parametrize(
    ("url", "why"),
    [
        ("postgresql://u:hunter2@a:x/db", "not a well-formed address"),
        ("postgresql://u:hunter2@/db?host=a,b,c&port=1,2", "as many ports as hosts"),
        ("postgresql://u:hunter2@a/db?nonsense=1", "not a well-formed address"),
        ("postgresql://u:hun@ter2@a/db", "%40"),
        ("postgresql://u:hunter2@a", "names no database"),
    ],
)
def test_an_address_of_a_database_that_cannot_be_is_refused_without_its_password(url: str, why: str) -> None:
    with pytest.raises(ValidationError, match=why) as refused:
        Settings(database_url=url)
    assert "ter2" not in str(refused.value)


@pytest.mark.parametrize("url", ["https://inband.example/sub", "inband.example", "ftp://inband.example"])
def test_the_public_address_is_an_origin(url: str) -> None:
    with pytest.raises(ValidationError, match="without a path"):
        Settings(public_url=url)


def test_commands_print_the_address_at_which_the_server_listens(tmp_path: Path) -> None:
    assert as_served(Settings(data_dir=tmp_path)).address == "http://127.0.0.1:8000"
    remember_address(Settings(data_dir=tmp_path, host="0.0.0.0", port=8765, allow_plain_http=True))
    assert as_served(Settings(data_dir=tmp_path)).address == "http://127.0.0.1:8765"
    assert as_served(Settings(data_dir=tmp_path, port=9000)).address == "http://127.0.0.1:9000"
    remember_address(Settings(data_dir=tmp_path, public_url="https://inband.example"))
    assert as_served(Settings(data_dir=tmp_path)).address == "https://inband.example"
    (tmp_path / SERVED).write_text("not JSON")
    assert as_served(Settings(data_dir=tmp_path)).port == 8000
