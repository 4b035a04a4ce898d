"""The page of a tool: its edge, its sister, its pause."""

from tests.shop import Person, Shop


class TestTool:
    def test_the_page_and_its_form(self, shop: Shop, operator: Person) -> None:
        shop.correction(shop.read(20.0)["correction"]["number"], "applied")
        path = f"/machines/{shop.machine}/tools/3"
        assert "−0.0200" in operator.open(path)
        text = operator.send(
            path, name="T03 finishing", edge="D1", kind="", sister="13", planned_parts="4", planned_total="25,5"
        )
        assert "is saved" in text
        tool = shop.tool()
        assert (tool["name"], tool["kind"], tool["sister"], tool["planned_parts"], tool["planned_total"]) == (
            "T03 finishing",
            None,
            13,
            4,
            0.0255,
        )
        assert "78" in text  # 20 of 25.5 µm
        assert "Switch to sister 13" in text
        text = operator.send(path, name="", edge="", kind="", sister="", planned_parts="", planned_total="")
        assert shop.tool()["planned_total"] is None
        for field, value in (("sister", "3"), ("sister", "x"), ("planned_parts", "-1"), ("planned_total", "much")):
            operator.send(path, 422, **{field: value})
        operator.open(f"/machines/{shop.machine}/tools/33", 404)

    def test_switching_to_the_sister(self, shop: Shop, operator: Person) -> None:
        shop.call("PATCH", f"/machines/{shop.machine}/tools/3", sister=13)
        path = f"/machines/{shop.machine}/tools/3/sister"
        assert "Select tool 13 at the machine" in operator.open(path)
        assert "Tool 13 takes over" in operator.send(path, reason="Edge worn")
        assert shop.tool(13)["characteristics"] == [shop.characteristic]
        operator.open(path, 404)  # nothing is left to be switched

    def test_a_pause_is_shown_everywhere(self, shop: Shop, operator: Person) -> None:
        shop.correction(shop.read(6.0)["correction"]["number"], "applied", offset_after=0.5)
        (alarm,) = shop.alarms()
        for page in (
            f"/machines/{shop.machine}/tools/3",
            f"/machines/{shop.machine}/tools?tool=3",
            f"/characteristics/{shop.characteristic}",
        ):
            text = operator.open(page)
            assert f"paused by alarm {alarm['id']}" in text, page
            assert f"/alarms/{alarm['id']}" in text, page
        assert 'data-state="paused"' in operator.open(f"/plant/{shop.machine}")
