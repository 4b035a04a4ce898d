"""Mail servers: what they say, encryption, and signing in."""

import socket
from pathlib import Path
from typing import Any

import pytest
from aiosmtpd.smtp import AuthResult

from app.loop.notifications import means
from app.loop.notifications.means import Answer, Job, Message, deliver
from app.settings import Settings
from tests.loop.notifications.sinks import Mails, certificate, mail_server, secure
from tests.loops import run


def mail(server: str, to: str = "anna@example.com", **settings: Any) -> Answer:
    job = Job(1, 1, "test", "mail", to, None, Message("Tool\r\nworn", "Text\n"))
    return run(deliver(job, Settings(mail_server=server, **settings)))


class TestWhatAMailServerSays:
    def test_a_refusal_is_on_record_in_its_words(self, mails: tuple[Mails, str]) -> None:
        answer = mail(mails[1], "refused@example.com", mail_security="none")
        assert answer == Answer(delivered=False, text="550 Nema korisnika „Đoka“")

    def test_a_mail_that_was_taken_is_taken_whatever_follows(self, mails: tuple[Mails, str]) -> None:
        assert mail(mails[1], "rude@example.com", mail_security="none").delivered

    def test_one_that_does_not_answer_may_have_taken_it(
        self, mails: tuple[Mails, str], monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(means, "LIMIT", 0.5)
        answer = mail(mails[1], "mute@example.com", mail_security="none")
        assert (answer.delivered, answer.perhaps) == (False, True)
        assert [each["To"] for each in mails[0].mails].count("mute@example.com") == 1

    def test_one_that_is_not_there_has_not(self) -> None:
        assert not mail("localhost:9", mail_security="none").perhaps

    @pytest.mark.parametrize("security", ["none", "starttls", "tls"])
    @pytest.mark.parametrize(
        ("failure", "said"),
        [
            (
                socket.gaierror(-2, "Name or service not known"),
                "the name of the mail server mail.example is not known here",
            ),
            (ConnectionRefusedError(111, "Connection refused"), "no mail server listens at mail.example"),
            (TimeoutError("timed out"), "mail.example does not answer"),
        ],
    )
    def test_what_cannot_be_reached_says_which_setting_to_look_at(
        self, monkeypatch: pytest.MonkeyPatch, failure: OSError, said: str, security: str
    ) -> None:
        def fails(*_where: Any, **_how: Any) -> None:
            raise failure

        monkeypatch.setattr(socket, "create_connection", fails)
        answer = mail("mail.example", mail_security=security)
        assert said in answer.text
        assert "check INBAND_MAIL_SERVER" in answer.text
        assert not answer.perhaps, "nothing was under way"

    def test_a_sender_that_is_refused_and_a_sign_in_that_is_not_offered(self, mails: tuple[Mails, str]) -> None:
        answer = mail(mails[1], mail_security="none", mail_user="anna", mail_password="secret")
        assert "INBAND_MAIL_USER" in answer.text
        answer = mail(mails[1], mail_security="none", mail_from="refused@example.com")
        assert answer.text == "553 Not yours; check INBAND_MAIL_FROM"


class TestEncryption:
    def test_a_mail_server_without_it_gets_nothing(self, mails: tuple[Mails, str]) -> None:
        before = len(mails[0].mails)
        answer = mail(mails[1])
        assert not answer.delivered
        assert "offers no STARTTLS: INBAND_MAIL_SECURITY" in answer.text
        assert len(mails[0].mails) == before

    def test_its_certificate_has_to_be_known(self, tmp_path: Path) -> None:
        pem = certificate(tmp_path)
        with mail_server(secure(pem)) as (sink, server):
            refused = mail(server)
            assert refused.text.startswith("certificate refused: ")
            assert "INBAND_CA_FILE" in refused.text
            assert sink.mails == []
            assert mail(server, ca_file=pem).delivered
        assert sink.encrypted == [True]
        assert sink.mails[0]["Subject"] == "Tool worn"

    def test_from_the_first_byte(self, tmp_path: Path) -> None:
        pem = certificate(tmp_path)
        with mail_server(secure(pem), first=True) as (sink, server):
            assert mail(server, mail_security="tls", ca_file=pem).delivered
            assert "INBAND_CA_FILE" in mail(server, mail_security="tls").text
        assert len(sink.mails) == 1

    def test_the_wrong_kind_says_which_setting_it_is(
        self, tmp_path: Path, mails: tuple[Mails, str], monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(means, "STEP", 0.3)
        assert "INBAND_MAIL_SECURITY=starttls" in mail(mails[1], mail_security="tls").text
        with mail_server(secure(certificate(tmp_path)), first=True) as (_sink, server):
            assert "INBAND_MAIL_SECURITY=tls" in mail(server).text

    def test_a_file_without_a_certificate_is_refused_at_the_start(self, tmp_path: Path) -> None:
        (tmp_path / "ca.pem").write_text("no certificate")
        with pytest.raises(ValueError, match="no certificate of an authority"):
            Settings(ca_file=tmp_path / "ca.pem")

    @pytest.mark.parametrize("way", ["PLAIN", "LOGIN"])
    @pytest.mark.parametrize("password", ["secret", "šifra ß"])
    def test_it_signs_in(self, tmp_path: Path, password: str, way: str) -> None:
        def knows(_server: Any, _session: Any, _envelope: Any, _mechanism: str, data: Any) -> AuthResult:
            right = (data.login, data.password) == (b"anna", password.encode())
            return AuthResult(success=right, handled=False)

        pem = certificate(tmp_path)
        others = [other for other in ("PLAIN", "LOGIN") if other != way]
        door: dict[str, Any] = {"authenticator": knows, "auth_required": True, "auth_exclude_mechanism": others}
        with mail_server(secure(pem), **door) as (sink, server):
            assert mail(server, ca_file=pem, mail_user="anna", mail_password=password).delivered
            refused = mail(server, ca_file=pem, mail_user="anna", mail_password=f"not {password}")
            assert refused.text.startswith("535 ")
            assert "INBAND_MAIL_PASSWORD" in refused.text
        assert len(sink.mails) == 1

    def test_without_a_mail_server_it_says_what_to_set(self) -> None:
        job = Job(1, 1, "test", "mail", "anna@example.com", None, Message("Test", "Text\n"))
        assert "INBAND_MAIL_SERVER" in run(deliver(job, Settings())).text
