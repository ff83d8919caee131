"""Who may come in: hosts, origins, the token, sizes; and what the page may ask for.

The server listens on the loopback address unless told otherwise. A browser is then still a way in for foreign pages,
so that three headers are checked before anything else: Host, against names that resolve to this machine only by a
trick (DNS rebinding); Origin, which must be the page itself; Content-Type, which no foreign form can set to JSON.
"""

from __future__ import annotations

import hmac
import ipaddress
import secrets
import socket
from dataclasses import dataclass, field
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qs, urlsplit

from .addresses import own_addresses

LARGEST_BODY = 1 << 16  # bytes
EVERYWHERE = {"0.0.0.0": "127.0.0.1", "::": "::1"}  # where all addresses are listened on: the one to this machine
LOOPBACK = ("localhost", "127.0.0.1", "::1")
ODD = frozenset("@/?#;, \\")  # never in a host and port; what follows them would go into the policy's header
SAFE_METHODS = ("GET", "HEAD", "OPTIONS")


@dataclass(frozen=True, kw_only=True)
class Door:
    """Where the server listens, and the token that it asks for; none on the loopback address."""

    host: str = "127.0.0.1"
    port: int
    token: str | None = None
    own_names: frozenset[str] = field(default_factory=lambda: frozenset({socket.gethostname().lower()}))

    @classmethod
    def at(cls, host: str, port: int) -> Door:
        """With a fresh token where ``host`` is not the loopback address."""
        return cls(host=host, port=port, token=None if is_loopback(host) else secrets.token_urlsafe(24))

    @property
    def url(self) -> str:
        """To be opened in a browser of this machine."""
        return self._url_at(EVERYWHERE.get(self.host, self.host))

    @property
    def urls_elsewhere(self) -> tuple[str, ...]:
        """To be opened on other machines, where the server listens on all addresses of this one."""
        return tuple(map(self._url_at, own_addresses(self.host == "::"))) if self.host in EVERYWHERE else ()

    def _url_at(self, host: str) -> str:
        name = f"[{host}]" if ":" in host else host
        return f"http://{name}:{self.port}/" + (f"?token={self.token}" if self.token else "")

    @property
    def cookie(self) -> str:
        return f"tendonrod_{self.port}"

    def refusal(self, scope: dict[str, Any]) -> tuple[int, str] | None:
        """Status and sentence for whoever may not come in; None for who may."""
        headers = {key.decode("latin-1"): value.decode("latin-1") for key, value in scope["headers"]}
        host = headers.get("host", "")
        if not self._is_ours(host):
            return 400, f"host {host[:80]!r} is not this server"
        origin = headers.get("origin")
        if origin is not None and urlsplit(origin.lower()).netloc != host.lower():
            return 403, f"origin {origin[:80]!r} is not this page"
        if headers.get("sec-fetch-site", "none") not in ("none", "same-origin") and not _opens_page(scope):
            return 403, "a request of another page"
        if self.token is not None and not self._knows_token(scope, headers):
            return 401, "the token is missing or wrong: open the address that was printed when the server started"
        return None

    def _is_ours(self, host: str) -> bool:
        try:
            parts = urlsplit(f"//{host}")
            name, port = (parts.hostname or "").lower(), parts.port or 80
        except ValueError:
            return False
        if port != self.port or set(host) & ODD:
            return False
        if name in LOOPBACK or name == self.host.lower():
            return True
        return self.token is not None and (name in self.own_names or _is_address(name))

    def _knows_token(self, scope: dict[str, Any], headers: dict[str, str]) -> bool:
        given = parse_qs(scope.get("query_string", b"").decode("latin-1")).get("token", [])
        given += [headers.get("authorization", "").removeprefix("Bearer ")]
        try:
            jar = SimpleCookie(headers.get("cookie", ""))
            given += [jar[self.cookie].value] if self.cookie in jar else []
        except CookieError:
            pass
        known = (self.token or "").encode()
        return any(hmac.compare_digest(each.encode(), known) for each in given)

    def headers(self, scope: dict[str, Any]) -> list[tuple[bytes, bytes]]:
        """Of every answer: nothing of the page leaves this server, and nobody frames it."""
        host = next((value.decode("latin-1") for key, value in scope["headers"] if key == b"host"), "")
        policy = (
            f"default-src 'self'; connect-src 'self' ws://{host}; img-src 'self' data: blob:; object-src 'none'; "
            "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
        )
        found = {
            "content-security-policy": policy if self._is_ours(host) else "default-src 'none'",
            "x-content-type-options": "nosniff",
            "referrer-policy": "no-referrer",  # the token is in the address
            "cross-origin-resource-policy": "same-origin",
            "cache-control": "no-store",
        }
        if self.token is not None and f"token={self.token}".encode() in scope.get("query_string", b""):
            found["set-cookie"] = f"{self.cookie}={self.token}; HttpOnly; SameSite=Strict; Path=/"
        return [(key.encode(), value.encode()) for key, value in found.items()]


class Guarded:
    """An ASGI application behind a door; JSON bodies of bounded size only."""

    def __init__(self, app: Any, door: Door) -> None:
        self.app, self.door = app, door

    async def __call__(self, scope: dict[str, Any], receive: Any, send: Any) -> None:
        if scope["type"] == "lifespan":
            await self.app(scope, receive, send)
        elif (refused := self.door.refusal(scope)) is not None:
            await _refuse(scope, receive, send, *refused, self.door.headers(scope))
        elif scope["type"] == "websocket":
            await self.app(scope, receive, send)
        else:
            await self._answer(scope, receive, self._with_headers(scope, send))

    async def _answer(self, scope: dict[str, Any], receive: Any, send: Any) -> None:
        if scope["method"] in SAFE_METHODS:
            await self.app(scope, receive, send)
            return
        kinds = [value.split(b";")[0].strip().lower() for key, value in scope["headers"] if key == b"content-type"]
        body = await _body(receive)
        if body is None:
            await _refuse(scope, receive, send, 413, f"a request of at most {LARGEST_BODY} bytes", [])
            return
        if kinds != [b"application/json"] and (kinds or body):  # nothing needs no kind
            await _refuse(scope, receive, send, 415, "send JSON, with Content-Type: application/json", [])
            return
        await self.app(scope, _again(body, receive), send)

    def _with_headers(self, scope: dict[str, Any], send: Any) -> Any:
        more = self.door.headers(scope)

        async def sending(message: dict[str, Any]) -> None:
            if message["type"] == "http.response.start":
                message = {**message, "headers": [*message.get("headers", []), *more]}
            await send(message)

        return sending


async def _refuse(
    scope: dict[str, Any], receive: Any, send: Any, status: int, text: str, headers: list[tuple[bytes, bytes]]
) -> None:
    import json

    if scope["type"] == "websocket":
        await receive()
        await send({"type": "websocket.close", "code": 1008, "reason": text[:120]})
        return
    body = json.dumps({"detail": text}).encode()
    kind = [(b"content-type", b"application/json"), (b"content-length", str(len(body)).encode())]
    await send({"type": "http.response.start", "status": status, "headers": [*kind, *headers]})
    await send({"type": "http.response.body", "body": b"" if scope.get("method") == "HEAD" else body})


async def _body(receive: Any) -> bytes | None:
    """The whole body, None where it is too large."""
    found = bytearray()
    while True:
        message = await receive()
        found += message.get("body", b"")
        if len(found) > LARGEST_BODY:
            return None
        if message["type"] != "http.request" or not message.get("more_body", False):
            return bytes(found)


def _again(body: bytes, receive: Any) -> Any:
    """A receive() that gives the body that was read already, then what comes after it."""
    waiting = [{"type": "http.request", "body": body, "more_body": False}]

    async def receiving() -> dict[str, Any]:
        return waiting.pop() if waiting else await receive()

    return receiving


def is_loopback(host: str) -> bool:
    try:
        return host.lower() == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


def _opens_page(scope: dict[str, Any]) -> bool:
    """A link that somebody follows from elsewhere opens the page; it may ask for nothing else."""
    return scope["type"] == "http" and scope["method"] == "GET" and scope["path"] == "/"
