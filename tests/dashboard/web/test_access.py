from __future__ import annotations

import pytest

from dashboard.web.access import Access, parse_address

LAB = parse_address("https://lab.example")
ACCESS = Access([LAB], "the token", "the password of the lab")


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("http://127.0.0.1:8080", "http://127.0.0.1:8080"),
        ("https://Lab.Example:443/", "https://lab.example"),
        ("http://[::1]:8080", "http://[::1]:8080"),
    ],
)
def test_address_is_written_as_browsers_write_an_origin(text: str, shown: str) -> None:
    assert str(parse_address(text)) == shown


@pytest.mark.parametrize(
    "text", ["lab.example", "ftp://lab", "http://", "http://a:x", "http://a/b", "http://u@a", ""]
)
def test_what_is_no_address_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="http://NAME:PORT"):
        parse_address(text)


@pytest.mark.parametrize("host", ["127.0.0.1:8080", "localhost:9", "[::1]:8080", "127.3.2.1"])
def test_loopback_names_are_the_pages_own(host: str) -> None:
    address = ACCESS.address_of(host)
    assert address is not None
    assert address.is_loopback


@pytest.mark.parametrize(
    "host",
    [
        "evil.example",
        "127.0.0.1.evil.example",
        "localhost.evil.example:8080",
        "evil.example@127.0.0.1",
        "192.168.0.7:8080",
        "lab.example:8080",
        "",
        "127.0.0.1:99999",
        "[::1",
    ],
)
def test_other_names_are_refused(host: str) -> None:
    assert ACCESS.address_of(host) is None


def test_origin_is_the_pages_own_only_with_scheme_name_and_port() -> None:
    here = ACCESS.address_of("127.0.0.1:8080")
    assert here is not None
    assert ACCESS.is_own_origin(here, "http://127.0.0.1:8080")
    for other in ("http://127.0.0.1:9999", "http://localhost:8080", "null", "", None):
        assert not ACCESS.is_own_origin(here, other)
    behind_proxy = ACCESS.address_of("lab.example")
    assert behind_proxy == LAB
    assert ACCESS.is_own_origin(LAB, "https://lab.example")
    assert not ACCESS.is_own_origin(LAB, "http://lab.example")


def test_token_admits_on_this_machine_and_the_password_elsewhere() -> None:
    here = parse_address("http://127.0.0.1:8080")
    assert ACCESS.admits_token(here, "the token")
    assert not ACCESS.admits_token(here, "the tokem")
    assert not ACCESS.admits_token(LAB, "the token")
    assert ACCESS.admits_password(LAB, "the password of the lab")
    assert not ACCESS.admits_password(LAB, "the token")
    assert not ACCESS.admits_password(here, "the password of the lab")
    assert not Access([LAB], "the token").admits_password(LAB, "")


def test_cookie_of_one_address_or_start_does_not_admit_at_another() -> None:
    here = parse_address("http://127.0.0.1:8080")
    cookie = ACCESS.cookie(here)
    assert ACCESS.admits_cookie(here, cookie)
    assert not ACCESS.admits_cookie(LAB, cookie)
    assert not Access([LAB], "another token").admits_cookie(here, cookie)
    assert not ACCESS.admits_cookie(here, "")
