"""The gate: who gets in, from where, and with what headers everything leaves."""

from __future__ import annotations

import logging

import pytest

from server.token import renew_token
from tests.server.conftest import BASE, Site

PAGES = ("/", "/new", "/new?preset=walker-walk", "/sign-in", "/api/runs", "/nowhere")
CROSS_SITE = (
    {"Sec-Fetch-Site": "cross-site"},
    {"Sec-Fetch-Site": "same-site"},
    {"Sec-Fetch-Site": "none"},
    {"Origin": "http://evil.example"},
    {"Origin": "null"},
    {"Origin": "http://127.0.0.1:9999"},
    {"Sec-Fetch-Site": "same-origin", "Origin": "http://evil.example"},
)


@pytest.mark.parametrize(
    "path",
    [
        "/",
        "/new",
        "/runs/x",
        "/experiments/x",
        "/compare?run=x&run=y",
        "/api/runs",
        "/api/experiments",
        "/api/experiments/x",
        "/api/openapi.json",
        "/artifacts/clips/1",
    ],
)
def test_nothing_is_served_without_the_token(site: Site, path: str) -> None:
    answer = site.anonymous.get(path)
    assert answer.status_code == 401
    assert answer.headers["www-authenticate"] == "Bearer"


@pytest.mark.parametrize("header", ["Bearer wrong", "Bearer ", "Basic abc", "Bearer \u00e9"])
def test_a_wrong_token_is_refused(site: Site, header: str) -> None:
    assert site.anonymous.get("/api/runs", headers={b"Authorization": header.encode()}).status_code == 401
    assert site.anonymous.get("/?token=wrong").status_code == 401


def test_health_and_static_files_need_none(site: Site) -> None:
    assert site.anonymous.get("/healthz").json() == {"status": "ok"}
    icon = site.anonymous.get("/sign-in").text.partition('rel="icon" href="')[2].partition('"')[0]
    answer = site.anonymous.get(icon)
    assert answer.status_code == 200
    assert "immutable" in answer.headers["cache-control"]


def test_the_link_with_the_token_signs_in_and_hides_it(site: Site) -> None:
    answer = site.anonymous.get(f"/new?preset=walker-walk&token={site.token}")
    assert answer.status_code == 303
    assert answer.headers["location"] == "/new?preset=walker-walk"
    cookie = answer.headers["set-cookie"]
    assert "HttpOnly" in cookie
    assert "SameSite=lax" in cookie
    assert site.token not in cookie
    assert site.anonymous.get("/").status_code == 200


def test_a_link_cannot_lead_away(site: Site) -> None:
    answer = site.anonymous.get(f"{BASE}//evil.example/x?token={site.token}")
    assert answer.headers["location"] == "/evil.example/x"
    same = {"Origin": BASE}
    form = {"token": site.token, "back": "//evil.example"}
    assert site.anonymous.post("/sign-in", data=form, headers=same).headers["location"] == "/evil.example"


def test_the_form_signs_in(site: Site) -> None:
    same = {"Origin": BASE}
    wrong = site.anonymous.post("/sign-in", data={"token": "x", "back": "/new"}, headers=same)
    assert wrong.status_code == 401
    assert "does not open" in wrong.text
    right = site.anonymous.post("/sign-in", data={"token": f" {site.token}\n", "back": "/new"}, headers=same)
    assert (right.status_code, right.headers["location"]) == (303, "/new")
    assert site.anonymous.get("/new").status_code == 200


def test_renewing_the_token_ends_every_session(site: Site) -> None:
    site.anonymous.get(f"/?token={site.token}")
    assert site.anonymous.get("/").status_code == 200
    renew_token(site.data)
    assert site.anonymous.get("/").status_code == 401
    assert site.client.get("/").status_code == 401


@pytest.mark.parametrize(
    "host", ["evil.example", "127.0.0.1.evil.example", "", "[::2]:80", "[", "localhost@x"]
)
def test_an_unknown_host_is_refused(site: Site, host: str) -> None:
    assert site.client.get("/healthz", headers={"Host": host}).status_code == 400


@pytest.mark.parametrize(
    "host", ["localhost", "LOCALHOST:81", "127.0.0.1:9", "[::1]:8000", "pebble.example:1"]
)
def test_known_hosts_are_served_on_any_port(site: Site, host: str) -> None:
    assert site.client.get("/healthz", headers={"Host": host}).status_code == 200


@pytest.mark.parametrize("headers", CROSS_SITE)
def test_other_sites_can_change_nothing(site: Site, headers: dict[str, str]) -> None:
    new = {"preset": "walker-walk"}
    assert site.client.post("/api/runs", json=new, headers=headers).status_code == 403
    assert site.client.post("/sign-in", data={"token": site.token}, headers=headers).status_code == 403
    assert site.client.get("/api/runs").json() == []


def test_a_cookie_alone_changes_nothing_unless_the_browser_says_it_is_our_page(site: Site) -> None:
    site.anonymous.get(f"/?token={site.token}")
    new = {"preset": "walker-walk"}
    assert site.anonymous.post("/api/runs", json=new).status_code == 403
    for same in ({"Origin": BASE}, {"Sec-Fetch-Site": "same-origin"}):
        assert site.anonymous.post("/api/runs", json=new, headers=same).status_code == 201


def test_a_proxy_in_front_may_speak_tls_with_the_browser(site: Site) -> None:
    ours = {"Origin": BASE.replace("http://", "https://"), "Sec-Fetch-Site": "same-origin"}
    assert site.client.post("/api/runs", json={"preset": "walker-walk"}, headers=ours).status_code == 201


def test_large_and_endless_bodies_are_refused(site: Site) -> None:
    assert site.client.post("/api/runs", content=b" " * 70_000).status_code == 413
    assert site.client.post("/api/runs", content=iter([b"{}"])).status_code == 411


@pytest.mark.parametrize("path", PAGES)
def test_every_answer_carries_the_policy(site: Site, path: str) -> None:
    for client in (site.anonymous, site.client):
        headers = client.get(path).headers
        policy = headers["content-security-policy"]
        assert policy.startswith("default-src 'none'; script-src 'self'; style-src 'self';")
        assert "unsafe" not in policy
        assert headers["x-content-type-options"] == "nosniff"
        assert headers["cross-origin-opener-policy"] == "same-origin"
        assert headers["cross-origin-resource-policy"] == "same-origin"
        assert headers["referrer-policy"] == "same-origin"
        assert headers["cache-control"] == "no-store"


def test_even_an_unexpected_failure_does(site: Site, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("server.dashboard.single_overviews", lambda _session: 1 / 0)
    answer = site.client.get("/")
    assert answer.status_code == 500
    assert "ZeroDivisionError" not in answer.text
    assert "default-src 'none'" in answer.headers["content-security-policy"]


def test_the_access_log_never_shows_the_token(site: Site, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.INFO, logger="pebble.access"):
        site.anonymous.get(f"/new?token={site.token}")
    assert "GET /new 303" in caplog.text
    assert site.token not in caplog.text
