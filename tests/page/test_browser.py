"""The page in a real browser: no message, no request, keyboard, pointer, phone, files."""

from __future__ import annotations

import re
import tomllib

import pytest

import mechdae as md
from mechdae.parts.page import link
from mechdae.parts.page.editor import editor
from tests.shared.browser import CHROMIUM, loaded, until
from tests.shared.page_gestures import PageGestures, played

playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")


SHOWN = {"four-bar-crank-rocker": "turn", "gorshkov-seven-link": "window", "double-pendulum": None}


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pages")
    return {name: md.page(name, task).save(folder / f"{name}.html") for name, task in SHOWN.items()}


def test_interface_for_embedding(opened):
    page = opened("four-bar-crank-rocker")
    assert page.evaluate("mechdae.live") is True
    assert page.evaluate("mechdae.set({'crank.angle': 1.0, b: 0.125})") is True
    pose = page.evaluate("mechdae.pose()")
    truth = md.solve("four-bar-crank-rocker", "turn", set={"b": 0.125})
    fresh = md.solve(
        md.load("four-bar-crank-rocker").with_values({"b": 0.125}).mechanism,
        md.Sweep(driver=md.Driver("crank.angle", at=(1.0,), speed=10.0)),
    )
    assert pose["status"] == "ok"
    for rate in ("position", "velocity", "acceleration"):
        wanted = getattr(fresh.points["coupler.P"], rate)[0]
        assert pose["points"]["coupler.P"][rate] == pytest.approx(wanted, rel=1e-12)
    swept = page.evaluate("mechdae.sweep('bodies/rocker/angle', 361)")
    assert swept == pytest.approx(truth.bodies["rocker"].angle.tolist(), abs=1e-12)
    assert page.evaluate("mechdae.set({nothing: 1})") is False
    assert "nothing" in page.evaluate("mechdae.reason")
    assert page.evaluate("mechdae.set({a: 9})") is False
    assert "opens at" in page.evaluate("mechdae.reason")
    assert (
        page.evaluate("mechdae.pose().points['coupler.P'].position")
        == pose["points"]["coupler.P"]["position"]
    )
    assert page.evaluate("mechdae.choose('+')") is True
    assert page.evaluate("mechdae.pose().mode") == "+"
    assert "b = 0.125" in page.evaluate("mechdae.toml()")


@pytest.mark.parametrize("kind", ["page", "editor"])
def test_what_fails_unforeseen_is_shown(browser, tmp_path, kind):
    page = browser.new_page()
    made = md.page("four-bar-crank-rocker", "turn") if kind == "page" else editor()
    loaded(page, made.save(tmp_path / "p.html"))
    alert = page.locator("p[role=alert]")
    assert alert.count() == 1
    assert not alert.is_visible()
    page.evaluate("void setTimeout(() => { throw new Error('first <b>') })")
    page.evaluate("void setTimeout(() => Promise.reject(new Error('second')))")
    until(page, "!document.querySelector('p[role=alert]').hidden")
    assert "first <b>" in alert.inner_text()
    page.close()


def test_fields_of_drivers_show_and_read_a_decimal_comma(browser, tmp_path):
    said: list[str] = []
    page = browser.new_page()
    page.on("console", lambda message: said.append(message.text))
    loaded(page, md.page("five-bar-robot", "circle", lang="ru").save(tmp_path / "p.html"))
    field = page.locator("#dimensions fieldset input[type=text]").first
    start = page.evaluate("mechdae.pose().points['tip.P'].position[0]")
    field.fill("60,5")
    field.blur()
    place = "mechdae.pose().points['tip.P'].position[0]"
    until(page, f"Math.abs({place} - 0.0605) < 1e-9")  # it is shown before it is moved to
    assert field.input_value() == "60,5"
    before = page.evaluate("mechdae.pose().points['tip.P'].position")
    spot = page.locator("[data-id='joint-P-pin']").bounding_box()
    page.mouse.move(spot["x"] + spot["width"] / 2, spot["y"] + spot["height"] / 2)
    page.mouse.down()
    page.mouse.move(spot["x"] + 30, spot["y"] + 20, steps=3)
    page.mouse.up()
    until(page, f"Math.abs({place} - 0.0605) > 1e-3")
    page.keyboard.press("Control+z")  # the drag, then the number
    until(page, f"Math.abs({place} - 0.0605) < 1e-9")
    assert page.evaluate("mechdae.pose().points['tip.P'].position") == before
    page.keyboard.press("Control+z")
    until(page, f"{place} === {start}")
    assert said == []
    page.close()


def test_the_bound_is_told_in_the_units_of_the_page(browser, tmp_path):
    """Where lengths are inches and angles radians, so is how far they may be off."""
    made = md.page("four-bar-crank-rocker", "turn", units="in,rad")
    page = browser.new_page()
    loaded(page, made.save(tmp_path / "inches.html"))
    said = page.locator("#status").inner_text()
    found = re.search(r"error at most (\S+) in, (\S+) rad", said)
    assert found is not None, said
    bound = page.evaluate("mechdae.pose().bound")
    assert float(found[1]) == pytest.approx(bound["length"] / 0.0254, rel=0.05)
    assert float(found[2]) == pytest.approx(bound["angle"], rel=0.05)
    page.close()


def test_keyboard_alone(opened):
    page = opened("gorshkov-seven-link")
    page.focus("#diagram")
    before = page.evaluate("mechdae.pose().driver['crank.angle']")
    page.keyboard.press("ArrowRight")
    until(page, f"mechdae.pose().driver['crank.angle'] > {before}")
    page.keyboard.press("End")
    until(page, "mechdae.pose().status === 'limit'")
    limits = page.evaluate("mechdae.limits()")
    assert limits == pytest.approx([-1.3312646100770071, 1.0625701691277127], abs=1e-12)
    page.keyboard.press("Home")
    until(page, f"mechdae.pose().driver['crank.angle'] < {limits[0] + 1e-9}")
    page.keyboard.press("]")
    assert page.evaluate("mechdae.pose().mode") != "+,+,-"
    page.keyboard.press(" ")
    until(page, "mechdae.pose().status === 'ok'")
    page.keyboard.press(" ")


def test_a_point_is_dragged_along_its_path(opened):
    page = opened("four-bar-crank-rocker")
    page.evaluate("mechdae.set({'crank.angle': 1.0})")
    box = page.locator("[data-id='point-coupler.P']").bounding_box()
    place = (box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.mouse.move(*place)
    page.mouse.down()
    page.mouse.move(place[0] - 30, place[1] - 10, steps=5)
    page.mouse.up()
    until(page, "Math.abs(mechdae.pose().driver['crank.angle'] - 1.0) > 0.01")
    assert page.evaluate("mechdae.pose().status") == "ok"


def test_dimensions_are_undone_as_gestures(opened):
    page = opened("four-bar-crank-rocker")
    field = page.get_by_label("b [mm]")
    field.fill("125")
    field.press("Enter")
    until(page, "mechdae.toml().includes('b = 0.125')")
    page.keyboard.press("Control+z")
    until(page, "!mechdae.toml().includes('b = 0.125')")
    page.keyboard.press("Control+Shift+z")
    until(page, "mechdae.toml().includes('b = 0.125')")
    until(page, "location.hash.includes('b=0.125')")


def test_the_address_holds_what_differs(opened):
    page = opened("four-bar-crank-rocker", "#b=0.125&s=1.5&mode=%2B")
    pose = page.evaluate("mechdae.pose()")
    assert pose["driver"]["crank.angle"] == 1.5
    assert pose["mode"] == "+"
    assert "b = 0.125" in page.evaluate("mechdae.toml()")


@pytest.mark.parametrize(("name", "seed"), [("four-bar-crank-rocker", 3), ("double-pendulum", 1)])
def test_random_gestures_leave_a_page_that_is_right(browser, pages, name, seed, tmp_path):
    gestures = played(browser, pages[name], name, seed, 12, tmp_path)
    assert gestures.faults == []
    assert gestures.compared >= (name == "four-bar-crank-rocker")


def test_what_gestures_must_leave_is_looked_at(browser, pages, tmp_path):
    """A text, a place, an error that are wrong: each is a fault."""
    page = browser.new_page()
    loaded(page, pages["four-bar-crank-rocker"])
    gestures = PageGestures(page, "four-bar-crank-rocker", 1, tmp_path)
    gestures.check(compare=True)
    assert gestures.faults == []
    page.evaluate(
        """() => {
        const pose = mechdae.pose();
        pose.points["coupler.C"].position[0] += 1e-9;
        mechdae.pose = () => pose;
        document.getElementById("title").textContent = "a NaN";
        console.log("said");
        }"""
    )
    gestures.check(compare=True)
    assert [text.split("\n")[0].split(" ")[0] for text in gestures.faults] == [
        *("console:", "a", "coupler.B,", "coupler.C,", "none")
    ]
    page.close()


def test_fields_refuse_what_makes_no_mechanism(browser, tmp_path):
    """A radius below zero, a link of no length, no number at all; then nothing is undone."""
    said: list[str] = []
    page = browser.new_page()
    page.on("console", lambda message: said.append(message.text))
    page.on("pageerror", lambda error: said.append(str(error)))
    file = md.page("cam-roller-follower").save(tmp_path / "p.html")
    loaded(page, file, "#100%&h=0.021&mode=%")
    assert "h = 0.021" in page.evaluate("mechdae.toml()")
    note = page.locator(".row", has=page.get_by_label("rho [mm]")).locator(".note")
    for typed, about in (("-8", "rho = -8 mm makes no mechanism"), ("abc", '"abc" is no number')):
        page.get_by_label("rho [mm]").fill(typed)
        page.keyboard.press("Enter")
        until(
            page,
            f"[...document.querySelectorAll('.note')].some((p) => p.textContent === {about!r})",
        )
        assert note.inner_text() == about
    page.keyboard.press("Tab")
    assert page.get_by_label("rho [mm]").input_value() == "8"
    before = page.evaluate("mechdae.toml()")
    page.keyboard.press("ArrowRight")  # a slider that is only passed is nothing to undo
    until(page, f"mechdae.toml() !== {before!r}")
    page.keyboard.press("Tab")
    page.keyboard.press("Tab")
    page.keyboard.press("Control+z")
    until(page, f"mechdae.toml() === {before!r}")
    assert page.evaluate("mechdae.set({rho: -0.001})") is False
    assert page.evaluate("mechdae.reason") == "rho = -1 mm makes no mechanism"
    assert said == []
    page.close()
    links = {
        own["name"]: own["refuses"] for own in md.page("four-bar-crank-rocker").data["sliders"]
    }
    assert links == {"a": "0", "b": "0", "c": "0", "d": "", "px": "", "py": ""}


@pytest.mark.parametrize("kind", ["SVG", "PNG", "CSV", "TOML"])
def test_files_come_out(opened, kind):
    page = opened("four-bar-crank-rocker")
    with page.expect_download() as waiting:
        page.get_by_role("button", name=kind).click()
    content = waiting.value.path().read_bytes()
    start = {"SVG": b"<svg", "PNG": b"\x89PNG", "CSV": b"status,drivers/", "TOML": b"schema"}
    assert content.startswith(start[kind])
    if kind == "CSV":
        assert len(content.splitlines()) == 362


@pytest.mark.parametrize(
    ("name", "width"),
    [("four-bar-crank-rocker", 320), ("gorshkov-seven-link", 390), ("double-pendulum", 320)],
)
def test_a_phone_does_not_scroll_sideways(opened, name, width):
    page = opened(name, viewport={"width": width, "height": 844}, has_touch=True)
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    for tab in page.locator("[role=tab]").all():
        tab.click()
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        small = page.evaluate(
            """() => [...document.querySelectorAll('button, select, input[type=text]')]
            .filter((own) => own.offsetParent && own.getBoundingClientRect().height < 24).length"""
        )
        assert small == 0


def test_recorded_poses_play(opened):
    page = opened("double-pendulum")
    assert "a motion is integrated" in page.evaluate("mechdae.live")
    before = page.evaluate("mechdae.pose().points")
    page.get_by_role("button", name="Play").click()
    until(page, "mechdae.pose().driver.t > 0.05")
    assert page.evaluate("mechdae.pose().points") != before
    assert page.evaluate("mechdae.set({t: 1})") is False


@pytest.mark.parametrize(
    "pattern",
    [
        r'"range":\[([^,]*),',
        r'"a","value":([^,]*),',
        r'"speed":(\d)',
    ],
    ids=["range", "slider", "speed"],
)
def test_altered_data_are_noticed(browser, pages, tmp_path, pattern):
    text = pages["four-bar-crank-rocker"].read_text(encoding="utf-8")
    data = re.search(pattern, text)
    assert data is not None
    file = tmp_path / "altered.html"
    file.write_text(text[: data.start(1)] + "7" + text[data.end(1) :], encoding="utf-8")
    page = browser.new_page()
    loaded(page, file)
    assert "altered" in page.evaluate("mechdae.live")
    assert "altered" in page.locator("#status").inner_text()
    assert page.evaluate("mechdae.pose()") is None
    assert page.locator("#diagram path").count() == 0
    page.close()


def test_kernels_that_differ_are_not_believed(browser, pages, tmp_path):
    """Where the numbers differ from Python's the recorded poses are shown."""
    text = pages["four-bar-crank-rocker"].read_text(encoding="utf-8")
    script = link.unpacked(text)
    wrong = script.replace('"Math.cos({0})"', '"(1.01*Math.cos({0}))"', 1)
    assert wrong != script
    text = text.replace(link.packed(script), link.packed(wrong), 1)
    file = tmp_path / "altered.html"
    file.write_text(text, encoding="utf-8")
    page = browser.new_page()
    loaded(page, file)
    assert "differ" in page.evaluate("mechdae.live")
    assert "recorded" in page.locator("#subtitle").inner_text()
    page.close()


@pytest.mark.parametrize("at", [0.1, 0.5, 0.999])
def test_an_altered_script_is_not_run(browser, pages, tmp_path, at):
    """One letter of the packed script is another one: nothing of it is run."""
    text = pages["four-bar-crank-rocker"].read_text(encoding="utf-8")
    found = link.PACKED.search(text)
    assert found is not None
    k = int(found.start(1) + at * len(found[1]))
    file = tmp_path / "altered.html"
    file.write_text(text[:k] + ("A" if text[k] != "A" else "B") + text[k + 1 :], encoding="utf-8")
    page = browser.new_page()
    loaded(page, file)
    assert page.locator("#status").inner_text() == "the file was altered"
    assert page.evaluate("mechdae.live === undefined")  # the element of the data
    page.close()


HOSTILE = (
    '</script><script>window.hurt = 1</script><img src=x onerror="window.hurt = 1">'
    '\u202e" onload="window.hurt = 1'
)


@pytest.mark.parametrize("lang", ["en", "ru"])
def test_hostile_titles_and_names_change_nothing(browser, tmp_path, lang):
    """Title, source and name of the file are texts, in the page and in what it saves."""
    own = md.load("slider-crank")
    with pytest.raises(md.InputError, match="not a name"):
        md.Problem(own.mechanism, {HOSTILE: own.task("turn")})
    problem = md.Problem(own.mechanism, own.tasks, name=HOSTILE, title=HOSTILE, source=HOSTILE)
    page = browser.new_page()
    loaded(page, md.page(problem, lang=lang).save(tmp_path / "hostile.html"))
    assert page.evaluate("window.hurt === undefined && mechdae.live") is True
    assert page.locator("#title").inner_text() == HOSTILE
    assert page.locator("#subtitle").inner_text() == f"{HOSTILE} / turn"
    assert page.locator("img").count() == 0
    assert page.locator("script").count() == 3
    assert tomllib.loads(page.evaluate("mechdae.toml()"))["title"] == HOSTILE
    page.close()


@pytest.mark.parametrize("name", ["a b", "a.b", "<b>", "\u202ea", "a'"])
def test_names_of_parts_are_letters(name):
    with pytest.raises(md.InputError):
        md.Mechanism(
            ground=md.Ground(points={"O": (0, 0)}),
            bodies=[md.Body(name, points={"O": (0, 0), "A": (1, 0)})],
            joints=[md.Revolute("O", "ground.O", f"{name}.O")],
        )


def test_hostile_files_change_nothing_in_the_editor(browser, tmp_path):
    problem = md.load("four-bar-double-rocker")
    problem = md.Problem(problem.mechanism, problem.tasks, name=HOSTILE, title=HOSTILE)
    page = browser.new_page()
    loaded(page, editor(problem).save(tmp_path / "hostile.html"))
    assert page.evaluate("window.hurt === undefined && mechdae.state().links.length") == 3
    assert page.locator("img").count() == 0
    assert tomllib.loads(page.evaluate("mechdae.toml()"))["title"] == HOSTILE
    page.close()
