"""Certificates that the bridge shows to controls, and simulated controls to the bridge. Needs ``cryptography`` (extra opcua)."""

from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Final, NamedTuple

from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import rsa
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

VALID_FOR: Final = timedelta(days=3653)
BEFORE_NOW: Final = timedelta(days=3653)
"""Certificates begin so long ago: a control whose clock is behind would say that they are not valid yet."""


class Pair(NamedTuple):
    """A certificate (DER) and its private key (PEM, not encrypted)."""

    certificate: bytes
    key: bytes


def new_pair(name: str, host: str, uri: str) -> Pair:
    """A certificate, signed by itself, for an OPC UA application; the application has to call itself by the same URI."""
    key = rsa.generate_private_key(public_exponent=65537, key_size=2048)
    subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])
    now = datetime.now(UTC)
    identifier = x509.SubjectKeyIdentifier.from_public_key(key.public_key())
    use = x509.KeyUsage(
        digital_signature=True,
        content_commitment=True,
        key_encipherment=True,
        data_encipherment=True,
        key_agreement=False,
        key_cert_sign=True,  # it signs itself
        crl_sign=False,
        encipher_only=False,
        decipher_only=False,
    )
    builder = (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(subject)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - BEFORE_NOW)
        .not_valid_after(now + VALID_FOR)
        .add_extension(identifier, critical=False)
        .add_extension(x509.AuthorityKeyIdentifier.from_issuer_subject_key_identifier(identifier), critical=False)
        .add_extension(
            x509.SubjectAlternativeName([x509.UniformResourceIdentifier(uri), x509.DNSName(host)]), critical=False
        )
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(use, critical=True)
        .add_extension(
            x509.ExtendedKeyUsage([ExtendedKeyUsageOID.CLIENT_AUTH, ExtendedKeyUsageOID.SERVER_AUTH]), critical=False
        )
    )
    certificate = builder.sign(key, hashes.SHA256())
    return Pair(
        certificate.public_bytes(Encoding.DER), key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())
    )


def write_pair(folder: Path, host: str) -> tuple[Path, Path, str]:
    """Make the bridge's certificate and key in a folder; the two files, and the URI in the certificate.

    Only the owner may read the key. Raises `FileExistsError` where one of the files is there already, and other `OSError`.
    """
    certificate, key = folder / "inband-bridge.der", folder / "inband-bridge.pem"
    for file in (certificate, key):
        if file.exists():
            raise FileExistsError(str(file))
    uri = f"urn:{host}:inband:bridge"
    pair = new_pair(f"Inband bridge on {host}"[:64], host, uri)
    folder.mkdir(parents=True, exist_ok=True)
    key.touch(mode=0o600)
    key.write_bytes(pair.key)
    certificate.write_bytes(pair.certificate)
    return certificate, key, uri


def uri_of(certificate: bytes) -> str | None:
    """The URI of the application in a certificate (DER or PEM), None if it has none.

    Raises `ValueError` where the content is no certificate.
    """
    found = read_certificate(certificate)
    try:
        names = found.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    except x509.ExtensionNotFound:
        return None
    uris = names.get_values_for_type(x509.UniformResourceIdentifier)
    return uris[0] if uris else None


def read_certificate(content: bytes) -> x509.Certificate:
    """A certificate, DER or PEM. Raises `ValueError` where it is none."""
    if content.lstrip().startswith(b"-----"):
        return x509.load_pem_x509_certificate(content)
    return x509.load_der_x509_certificate(content)
