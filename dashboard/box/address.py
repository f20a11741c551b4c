"""The address of the page, which the launcher prints before the box runs; it needs no web library."""

from secrets import token_urlsafe

from dashboard.mode import LOOPBACK

BYTES = 18  # of chance in a token


def token() -> str:
    """Return a new token: who has it may see and steer the fleet."""
    return token_urlsafe(BYTES)


def address(port: int, token: str) -> str:
    """Return the address of the page."""
    return f"http://{LOOPBACK}:{port}/?token={token}"
