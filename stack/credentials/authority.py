"""Certificate authority of one cell: signs a certificate for each user of its bus."""

from __future__ import annotations

import datetime
import ipaddress
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from lariat.configuration import ConfigurationError
from stack.credentials.private_file import write_private

AUTHORITY_NAME = "Lariat cell"
"""Common name of the authority's own certificate."""
_LABEL = r"[a-z0-9_](?:[a-z0-9_-]{0,61}[a-z0-9_])?"
_HOST_NAME = re.compile(rf"(?=.{{1,253}}$)(?:{_LABEL}\.)*(?!\d+$){_LABEL}", re.IGNORECASE)
CLOCK_MARGIN = datetime.timedelta(days=1)
"""Time before its making from which a certificate is valid: clocks of machines differ."""


@dataclass(frozen=True)
class Credential:
    """Certificate of a user, with its private key."""

    certificate: bytes
    """Certificate, PEM."""
    key: bytes
    """Private key, PEM without a password."""


class Authority:
    """Certificate and private key of a cell's authority."""

    def __init__(self, certificate: x509.Certificate, key: ec.EllipticCurvePrivateKey) -> None:
        self._certificate, self._key = certificate, key

    @classmethod
    def create(cls, days: int) -> Authority:
        """Create an authority with a new key and a certificate for some days."""
        key = ec.generate_private_key(ec.SECP256R1())
        name = _name(AUTHORITY_NAME)
        builder = _builder(name, name, key.public_key(), days)
        builder = builder.add_extension(x509.BasicConstraints(ca=True, path_length=0), True)
        builder = builder.add_extension(_key_usage(signs_certificates=True), True)
        return cls(builder.sign(key, hashes.SHA256()), key)

    @classmethod
    def load(cls, folder: Path) -> Authority:
        """Load the authority that `save` wrote."""
        try:
            certificate = x509.load_pem_x509_certificate((folder / "certificate.pem").read_bytes())
            key = serialization.load_pem_private_key((folder / "key.pem").read_bytes(), None)
        except (OSError, ValueError) as error:
            raise ConfigurationError(
                f"cannot read the authority in {folder} ({error}); name another folder, or remove "
                "this one to make all credentials anew"
            ) from None
        assert isinstance(key, ec.EllipticCurvePrivateKey)
        return cls(certificate, key)

    def save(self, folder: Path) -> None:
        """Write the certificate, and the private key for the owner's eyes only."""
        write_private(folder / "certificate.pem", self.certificate)
        write_private(folder / "key.pem", _private_pem(self._key))

    @property
    def certificate(self) -> bytes:
        """Certificate with which users check each other, PEM."""
        return self._certificate.public_bytes(serialization.Encoding.PEM)

    @property
    def days_left(self) -> float:
        """Time until the certificate expires [d]."""
        return days_left(self.certificate)

    def sign(self, user: str, addresses: Sequence[str], days: int) -> Credential:
        """Create the credential of a user, by whose name access is controlled.

        Addresses: where it may be reached; empty for a user that only connects.
        """
        key = ec.generate_private_key(ec.SECP256R1())
        issuer = self._certificate.subject
        builder = _builder(_name(user), issuer, key.public_key(), days)
        builder = builder.add_extension(x509.BasicConstraints(ca=False, path_length=None), True)
        builder = builder.add_extension(_key_usage(signs_certificates=False), True)
        usage = ExtendedKeyUsageOID.SERVER_AUTH if addresses else ExtendedKeyUsageOID.CLIENT_AUTH
        builder = builder.add_extension(x509.ExtendedKeyUsage([usage]), False)
        if addresses:
            names = x509.SubjectAlternativeName([_general_name(a) for a in addresses])
            builder = builder.add_extension(names, False)
        issued_by = x509.AuthorityKeyIdentifier.from_issuer_public_key(self._key.public_key())
        builder = builder.add_extension(issued_by, False)
        signed = builder.sign(self._key, hashes.SHA256())
        return Credential(signed.public_bytes(serialization.Encoding.PEM), _private_pem(key))


def check_address(address: str) -> None:
    """Check the address of a router."""
    if _HOST_NAME.fullmatch(address):
        return
    try:
        ipaddress.ip_address(address)
    except ValueError:
        raise ConfigurationError(
            f"--address {address!r} is neither an IP address nor a host name; give one such as "
            "192.168.5.2 or cell.lab"
        ) from None


def days_left(certificate: bytes) -> float:
    """Return the time until a certificate expires [d]."""
    end = x509.load_pem_x509_certificate(certificate).not_valid_after_utc
    return (end - _now()) / datetime.timedelta(days=1)


def _builder(
    subject: x509.Name, issuer: x509.Name, key: ec.EllipticCurvePublicKey, days: int
) -> x509.CertificateBuilder:
    builder = x509.CertificateBuilder().subject_name(subject).issuer_name(issuer).public_key(key)
    builder = builder.serial_number(x509.random_serial_number())
    builder = builder.not_valid_before(_now() - CLOCK_MARGIN)
    builder = builder.not_valid_after(_now() + datetime.timedelta(days=days))
    return builder.add_extension(x509.SubjectKeyIdentifier.from_public_key(key), False)


def _key_usage(*, signs_certificates: bool) -> x509.KeyUsage:
    return x509.KeyUsage(
        digital_signature=True,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        key_cert_sign=signs_certificates,
        crl_sign=signs_certificates,
        encipher_only=False,
        decipher_only=False,
    )


def _name(common: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, common)])


def _general_name(address: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ipaddress.ip_address(address))
    except ValueError:
        return x509.DNSName(address)


def _private_pem(key: ec.EllipticCurvePrivateKey) -> bytes:
    return key.private_bytes(
        serialization.Encoding.PEM,
        serialization.PrivateFormat.PKCS8,
        serialization.NoEncryption(),
    )


def _now() -> datetime.datetime:
    return datetime.datetime.now(datetime.UTC)
