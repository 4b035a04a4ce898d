import re
from datetime import UTC, datetime, timedelta, timezone
from zoneinfo import ZoneInfo

import httpx
import pytest

from app.charts import PALETTES, time_axis
from app.language import formatting, i18n
from app.language.times import in_zone
from app.web.assets import FOREVER, STATIC_DIR
from app.web.templates import assets, environment


class TestNumbers:
    @pytest.mark.parametrize(
        ("value", "text"),
        [(0.0061, "+6.1 µm"), (-0.3, "−300.0 µm"), (0.0, "+0.0 µm"), (-0.00001, "+0.0 µm"), (None, "–")],
    )
    def test_deviations_always_have_their_sign(self, value: float | None, text: str) -> None:
        assert formatting.um(value).replace("\xa0", " ") == text

    def test_sizes_have_four_decimals(self) -> None:
        assert formatting.mm(39.9981).replace("\xa0", " ") == "39.9981 mm"
        assert formatting.mm(-0.5) == "−0.5000\xa0mm"

    def test_limits_have_no_more_decimals_than_they_need(self) -> None:
        assert [formatting.um_limit(x).replace("\xa0", " ") for x in (0.0053, 0.3, 1.0)] == [
            "±5.3 µm",
            "±300 µm",
            "±1 mm",
        ]

    def test_moments_are_those_of_the_plant_and_carry_their_offset(self) -> None:
        moment = datetime(2026, 11, 21, 9, 15, 2, tzinfo=timezone(timedelta(hours=1)))
        with in_zone(ZoneInfo("Asia/Kathmandu")):
            assert formatting.when(moment) == (
                '<time datetime="2026-11-21T14:00:02+05:45" title="Asia/Kathmandu, UTC+05:45">21 Nov 2026 14:00:02</time>'
            )

    def test_a_wall_clock_time_that_is_there_twice_has_its_offset(self) -> None:
        with in_zone(ZoneInfo("Europe/Berlin")):
            first = datetime(2026, 10, 25, 0, 30, tzinfo=UTC)
            assert formatting.when(first, "minutes").striptags() == "25 Oct 2026 02:30 UTC+02:00"
            assert formatting.when(first + timedelta(hours=1), "minutes").striptags() == "25 Oct 2026 02:30 UTC+01:00"
            assert formatting.when(first + timedelta(hours=2), "minutes").striptags() == "25 Oct 2026 03:30"

    def test_ages_have_one_unit(self) -> None:
        now = datetime(2026, 11, 21, 9, 0, tzinfo=UTC)
        ages = [formatting.ago(now - timedelta(seconds=s), now).striptags() for s in (12, 200, 90_000, 400_000)]
        assert ages == ["12 s ago", "3 min ago", "25 h ago", "4 d ago"]


class TestLanguage:
    @pytest.mark.parametrize("header", [None, "", "xx", "en-GB,en;q=0.9", "*", ";;,,"])
    def test_english_where_nothing_better_is_there(self, header: str | None) -> None:
        assert i18n.negotiate(header) == "en"

    def test_speaking_ends(self) -> None:
        with i18n.speaking("sr"):
            assert i18n.current_language() == "sr"
            assert i18n._("Oversize") == "Oversize"  # no catalog: the source's words
        assert i18n.current_language() == "en"


class TestAssets:
    def test_the_address_changes_with_the_content_and_is_kept_for_ever(self, client: httpx.Client) -> None:
        url = assets().url("css/base.css")
        assert re.fullmatch(r"/static/[0-9a-f]{12}/css/base\.css", url)
        answer = client.get(url)
        assert answer.headers["cache-control"] == FOREVER
        assert answer.headers["content-type"].startswith("text/css")
        assert answer.headers["content-encoding"] == "gzip"
        assert answer.content == (STATIC_DIR / "css/base.css").read_bytes()

    def test_an_old_address_still_answers_but_is_not_kept(self, client: httpx.Client) -> None:
        answer = client.get("/static/000000000000/css/base.css")
        assert (answer.status_code, answer.headers["cache-control"]) == (200, "no-cache")

    def test_plotly_comes_out_of_its_package(self, client: httpx.Client) -> None:
        answer = client.get(assets().url("plotly.min.js"), headers={"Accept-Encoding": "identity"})
        assert "content-encoding" not in answer.headers
        assert b"plotly.js v4" in answer.content[:200]

    @pytest.mark.parametrize("path", ["/static/", "/static/x/../../app/settings.py", "/static/x/nothing.css"])
    def test_nothing_else_is_served(self, client: httpx.Client, path: str) -> None:
        assert client.get(path).status_code == 404

    def test_a_template_that_names_a_missing_file_fails(self) -> None:
        with pytest.raises(LookupError, match=r"css/nothing\.css"):
            assets().url("css/nothing.css")


class TestLook:
    def test_charts_and_pages_have_the_same_colours(self) -> None:
        tokens = (STATIC_DIR / "css/tokens.css").read_text()
        light, dark = PALETTES["light"], PALETTES["dark"]
        for name in light:
            assert f"--{name}: light-dark({light[name]}, {dark[name]});" in tokens

    @pytest.mark.parametrize("theme", ["light", "dark"])
    def test_what_is_read_stands_out_from_its_ground(self, theme: str) -> None:
        colours = PALETTES[theme]  # type: ignore[index]
        for name in ("ink", "quiet", "attention", "wear", "stop", "waiting"):
            assert contrast(colours[name], colours["surface"]) >= 4.5, name

    def test_no_template_has_what_the_policy_forbids(self) -> None:
        for name in environment().list_templates():
            text = environment().loader.get_source(environment(), name)[0]  # type: ignore[union-attr]
            assert not re.search(r'\sstyle="|<style|\son[a-z]+="|<script(?![^>]*\ssrc=)', text), name

    def test_every_module_is_short_and_says_what_it_is(self) -> None:
        for module in (STATIC_DIR / "js").glob("*.js"):
            lines = module.read_text().splitlines()
            assert len(lines) < 150, module.name
            assert lines[0].startswith("//"), module.name


class TestPages:
    def test_every_answer_carries_the_policy(self, client: httpx.Client) -> None:
        for path in ("/", "/static/x/nothing.css", "/figures/zones"):
            headers = client.get(path).headers
            assert "default-src 'self'" in headers["content-security-policy"]
            assert "unsafe" not in headers["content-security-policy"]
            assert headers["x-content-type-options"] == "nosniff"

    def test_the_theme_is_right_from_the_first_paint(self, client: httpx.Client) -> None:
        assert "data-theme" not in client.get("/").text.split(">")[1]
        client.cookies.set("inband_theme", "dark")
        assert '<html lang="en" data-theme="dark">' in client.get("/").text
        client.cookies.set("inband_theme", '"><script>')
        assert "data-theme" not in client.get("/").text.split("<head>")[0]

    def test_a_problem_says_what_where_and_what_to_do(self, client: httpx.Client) -> None:
        answer = client.get("/problem")
        assert answer.status_code == 422
        for words in ("The limits must lie", "averaging_limit", "R34 (5.3 µm) must be larger", "Make R33 smaller"):
            assert words in answer.text


def contrast(one: str, other: str) -> float:
    """The contrast ratio of WCAG 2."""

    def luminance(colour: str) -> float:
        channels = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
        red, green, blue = (c / 12.92 if c <= 0.03928 else ((c + 0.055) / 1.055) ** 2.4 for c in channels)
        return 0.2126 * red + 0.7152 * green + 0.0722 * blue

    high, low = sorted((luminance(one), luminance(other)), reverse=True)
    return (high + 0.05) / (low + 0.05)


def test_an_axis_of_time_of_one_moment_shows_the_day_about_it_and_no_seconds() -> None:
    at = datetime(2026, 11, 22, 9, 30, tzinfo=UTC)
    assert time_axis([at]).reach == (at - timedelta(hours=12), at + timedelta(hours=12))
    assert time_axis([at, at + timedelta(days=1)]).reach is None
    assert time_axis().reach is None
