"""The certificates of one fleet: an authority that issues them, and the checks of what it has issued."""

from collections.abc import Mapping, Sequence
from datetime import datetime, timedelta
from ipaddress import ip_address
from pathlib import Path
from typing import Final, NamedTuple, NoReturn

from cryptography import x509
from cryptography.exceptions import InvalidSignature, UnsupportedAlgorithm
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import (
    Encoding,
    NoEncryption,
    PrivateFormat,
    load_pem_private_key,
)
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from swarm.errors import ConfigError
from swarm.secure.names import AUTHORITY, CERTIFICATE, KEY

EARLIER: Final = timedelta(minutes=5)  # a certificate is valid from then on: the clocks of two hosts differ
HERE: Final = ("127.0.0.1", "::1", "localhost")  # names of the router that every fleet's certificate has


class Files(NamedTuple):
    """A certificate and its private key, as PEM."""

    certificate: bytes
    key: bytes


class Authority:
    """A certificate authority whose private key exists only in this object: nobody can issue a certificate later."""

    def __init__(self, begin: datetime, end: datetime) -> None:
        self._key = ec.generate_private_key(ec.SECP256R1())
        self._span = begin, end
        self._name = _name_attribute("zenoh-swarm")
        usage = x509.KeyUsage(
            digital_signature=True, key_cert_sign=True, crl_sign=True, content_commitment=False,
            key_encipherment=False, data_encipherment=False, key_agreement=False, encipher_only=False,
            decipher_only=False,
        )  # fmt: skip
        builder = self._builder(self._name, self._key.public_key(), self._span)
        builder = builder.add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        self._certificate = builder.add_extension(usage, critical=True).sign(self._key, hashes.SHA256())

    @property
    def certificate(self) -> bytes:
        """The authority's own certificate, as PEM."""
        return self._certificate.public_bytes(Encoding.PEM)

    def client(self, name: str, span: tuple[datetime, datetime] | None = None) -> Files:
        """Issue a certificate with which a process connects; it cannot be a router's."""
        return self._issue(name, [ExtendedKeyUsageOID.CLIENT_AUTH], (), span)

    def router(self, name: str, hosts: Sequence[str], *, joins: bool = False) -> Files:
        """Issue a certificate for a router that is reached by these names and addresses, and that ``joins`` others."""
        client = [ExtendedKeyUsageOID.CLIENT_AUTH] if joins else []
        return self._issue(name, [ExtendedKeyUsageOID.SERVER_AUTH, *client], hosts, None)

    def _issue(
        self, name: str, uses: list[x509.ObjectIdentifier], hosts: Sequence[str], span: tuple[datetime, datetime] | None
    ) -> Files:
        key = ec.generate_private_key(ec.SECP256R1())
        builder = self._builder(_name_attribute(name), key.public_key(), span or self._span)
        builder = builder.add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        builder = builder.add_extension(x509.ExtendedKeyUsage(uses), critical=False)
        if hosts:
            builder = builder.add_extension(
                x509.SubjectAlternativeName([_host(host) for host in hosts]), critical=False
            )
        signed = builder.sign(self._key, hashes.SHA256())
        pem = key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())
        return Files(signed.public_bytes(Encoding.PEM), pem)

    def _builder(
        self, subject: x509.Name, key: ec.EllipticCurvePublicKey, span: tuple[datetime, datetime]
    ) -> x509.CertificateBuilder:
        return x509.CertificateBuilder(
            issuer_name=self._name,
            subject_name=subject,
            public_key=key,
            serial_number=x509.random_serial_number(),
            not_valid_before=span[0],
            not_valid_after=span[1],
        )


def _name_attribute(name: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])


def _host(name: str) -> x509.GeneralName:
    """Return a router's address or name.

    Raises:
        ConfigError: it is neither.
    """
    try:
        return x509.IPAddress(ip_address(name))
    except ValueError:
        pass
    try:
        return x509.DNSName(name)
    except ValueError:
        raise ConfigError(f"--host: expected the name or address of a host, got {name!r}; correct it") from None


def check(folder: Path, name: str, contents: Mapping[str, bytes], now: datetime) -> None:
    """Check that a certificate is of this name, valid now and issued by the authority, and that the key is its own.

    Raises:
        ConfigError: the first of these that is not so.
    """

    def wrong(file: str, text: str) -> NoReturn:
        raise ConfigError(f"{folder / file}: {text}")

    try:
        authority = x509.load_pem_x509_certificate(contents[AUTHORITY])
    except ValueError:
        wrong(AUTHORITY, "expected a certificate in PEM, got something else; copy it from where `swarm keys` made it")
    try:
        own = x509.load_pem_x509_certificate(contents[CERTIFICATE])
    except ValueError:
        wrong(CERTIFICATE, "expected a certificate in PEM, got something else; copy it from where `swarm keys` made it")
    try:
        key = load_pem_private_key(contents[KEY], password=None)
    except (ValueError, TypeError, UnsupportedAlgorithm):
        wrong(KEY, "expected a private key in PEM without a password; copy it from where `swarm keys` made it")
    names = [str(one.value) for one in own.subject.get_attributes_for_oid(NameOID.COMMON_NAME)]
    if names != [name]:
        found = " and ".join(names) or "nobody"
        wrong(CERTIFICATE, f"expected the certificate of {name}, got that of {found}; put each into its own folder")
    if key.public_key() != own.public_key():
        wrong(KEY, "expected the key of certificate.pem, got another one; copy both from one folder")
    try:
        own.verify_directly_issued_by(authority)
    except (ValueError, TypeError, InvalidSignature):
        wrong(CERTIFICATE, f"expected one that {AUTHORITY} has issued, got another; copy both from one folder")
    for file, one in ((AUTHORITY, authority), (CERTIFICATE, own)):
        if now >= one.not_valid_after_utc:
            text = f"expired on {one.not_valid_after_utc:%Y-%m-%d %H:%M} UTC; make new keys with `swarm keys`"
            wrong(file, f"expected a certificate that is valid now, got one that {text}")
        if now < one.not_valid_before_utc:
            text = f"is valid from {one.not_valid_before_utc:%Y-%m-%d %H:%M} UTC on; correct this machine's clock"
            wrong(file, f"expected a certificate that is valid now, got one that {text}")
