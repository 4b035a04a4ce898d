"""Pages of connections: all of them, one machine's, and where else they are shown."""

import pytest
from playwright.sync_api import Page, expect

from app.loop.connections import wording
from tests.loop.connections.test_alarms import run, silent_for
from tests.loop.connections.test_heartbeat import ago, beat
from tests.pages.looks import live
from tests.shop import Person, Shop


def test_the_list_says_how_each_stands(shop: Shop, viewer: Person) -> None:
    beat(
        shop,
        state="control_away",
        detail="The control refuses the connection.",
        clock_offset=-7200.0,
        kind="haas",
        quarantined=4,
        hold_all=True,
    )
    page = viewer.open("/connections")
    row = page.partition(f'href="/machines/{shop.machine}/connection"')[2].partition("</tr>")[0]
    assert "The control refuses the connection." in row
    assert "−7200.0 s" in row
    assert 'data-tone="attention"' in row
    assert "haas" in row
    assert "Control does not answer" in page
    assert "On hold" in page
    home = viewer.open(f"/machines/{shop.machine}")
    assert "Bridge heard" in home
    assert f'href="/machines/{shop.machine}/connection"' in home


def test_the_page_of_a_machine_shows_proofs_and_quarantine(shop: Shop, viewer: Person) -> None:
    assert "No bridge has spoken for this machine" in viewer.open(f"/machines/{shop.machine}/connection")
    beat(
        shop,
        identity="SN-4711",
        mapping="5b8c1f0e",
        quarantined=30,
        quarantine=[
            {"key": "a:1:2", "characteristic": "seat", "reason": "No <such> characteristic.", "at": ago(hours=1)}
        ],
        locations=[
            {"tool_memory": 3, "mapping": "77d0", "proved_at": ago(days=1), "offset": -0.0123},
            {"tool_memory": 4, "mapping": "88e1"},
        ],
    )
    page = viewer.open(f"/machines/{shop.machine}/connection")
    assert f"inband bridge touch-test --config plant.toml {shop.machine} 4" in page
    assert f"plant.toml {shop.machine} 3<" not in page
    assert "No &lt;such&gt; characteristic." in page
    assert "The newest 1 of 30." in page
    for shown in ("SN-4711", "5b8c1f0e", "−0.0123", "proved"):
        assert shown in page
    assert "Remove the connection" not in page


def test_a_silent_bridge_is_shown_and_an_administrator_removes_it(shop: Shop, admin: Person, engineer: Person) -> None:
    beat(shop, detail="all is well")
    silent_for(shop, 5)
    run(shop)
    path = f"/machines/{shop.machine}/connection"
    page = admin.open(path)
    assert "Silent" in page
    assert "all is well" not in page, "what it said last is not how it is now"
    assert f'href="{path}"' in admin.open(f"/alarms?machine={shop.machine}")
    engineer.send(f"{path}/remove", 403)
    assert "No bridge has spoken for this machine" in admin.send(f"{path}/remove")
    assert shop.alarms() == []


def test_the_page_follows_by_itself(shop: Shop, viewer: Person, page: Page) -> None:
    beat(shop)
    page.clock.install()
    viewer.sign_in(page)
    page.goto(f"/machines/{shop.machine}/connection")
    expect(page.locator("#connection .badge").first).to_have_text("Online")
    live(page)
    beat(shop, state="wrong_machine", detail="SN-2 answers, not SN-1.")
    expect(page.locator("#connection .badge").first).to_have_text("Wrong machine")
    expect(page.locator("#connection")).to_contain_text("SN-2 answers, not SN-1.")
    beat(shop, state="wrong_machine", waiting=12)  # no event: it is looked at every ten seconds
    page.clock.fast_forward(10_000)
    expect(page.locator("#connection .readouts")).to_contain_text("12")


def test_keys_say_when_they_were_used_last(shop: Shop, engineer: Person) -> None:
    beat(shop)
    keys = shop.call("GET", f"/machines/{shop.machine}/keys")["items"]
    assert set(keys[0]) >= {"last_used_at", "created_at"}
    shop.call("POST", f"/machines/{shop.machine}/keys", 201, name="spare")
    page = engineer.open(f"/setup/machines/{shop.machine}")
    assert "Last used" in page
    assert "never" in page


@pytest.mark.parametrize(
    ("offset", "said", "off"),
    [(None, "–", False), (0.84, "+0.8 s", False), (-2.4, "−2.4 s", True), (-172_800, "−2.0 days", True)],
)
def test_clocks_in_words(offset: float | None, said: str, off: bool) -> None:
    assert (wording.clock(offset), wording.clock_is_off(offset)) == (said, off)


def test_every_state_has_a_word_and_a_sentence() -> None:
    for state in (
        "starting",
        "online",
        "control_away",
        "wrong_machine",
        "counters_lost",
        "full",
        "held",
        "configuration",
    ):
        assert wording.explained(f"connection_{state}")
    assert wording.explained(wording.SILENT)
