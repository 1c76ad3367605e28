"""What a page teaches: dimension lines, curves of what is clicked, explained steps, switches."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest

import mechdae as md
from mechdae.parts.page import link
from tests.shared.browser import CHROMIUM, covered, loaded, until

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")

CASES = {
    "four-bar-crank-rocker": "turn",
    "whitworth-quick-return": "turn",
    "slider-crank-inertia": "cycle",
    "gorshkov-seven-link": "window",
    "coasting-slider-crank": "motion",
    "rssr": None,
    "quick-return-friction": "cycle",
    "delta-robot": None,
}
SCREEN = {"viewport": {"width": 1280, "height": 800}}
MIDDLE = """(own) => { const { x, y, width, height } = own.getBoundingClientRect();
  return [x + width / 2, y + height / 2]; }"""


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pages")
    found = {
        name: md.page(name, task).save(folder / f"{name}.html") for name, task in CASES.items()
    }
    guide, bar = [0.0, 0.0], {"P": [0, 0], "Q": ["l", 0]}
    block = {"E": [0, 0]}
    carriage = md.Mechanism(
        parameters={"l": 0.1},
        ground=md.Ground({"A": guide, "B": [0.0, 0.06]}),
        bodies=[md.Body("cart", block), md.Body("bar", bar), md.Body("rider", block)],
        joints=[
            md.Prismatic("low", "ground.A", "cart.E"),
            md.Revolute("P", "cart.E", "bar.P"),
            md.Revolute("Q", "bar.Q", "rider.E"),
            md.Prismatic("high", "ground.B", "rider.E"),
        ],
        sketch={"low": 0.02, "bar": 0.6, "high": 0.1},
    )
    led = md.Sweep(driver=md.Driver("low.slide", from_=0.0, to=0.1, speed=0.2), poses=5)
    found["carriage"] = md.page(carriage, led).save(folder / "carriage.html")
    russian = md.page("four-bar-crank-rocker", "turn", lang="ru")
    return found | {"russian": russian.save(folder / "russian.html")}


def middle(page, selector):
    """Return the middle of an element on the screen."""
    return page.locator(selector).first.evaluate(MIDDLE)


def pointed(page, selector):
    """Bring the mouse to the middle of an element."""
    page.mouse.move(*middle(page, selector))


def number(text):
    """Return the number that a text begins with."""
    return float(re.match(r"-?[\d.]+(?:e-?\d+)?", text.strip())[0])


@pytest.mark.parametrize("name", [*CASES][:6])
def test_one_screen_and_every_control_says_what_it_does(opened, name):
    page = opened(name, **SCREEN)
    sizes = "[document.documentElement.scrollHeight, document.documentElement.scrollWidth]"
    for tab in page.locator("[role=tab]").all():
        tab.click()
        assert page.evaluate(sizes) == [800, 1280]
        mute = page.evaluate(
            """() => [...document.querySelectorAll("button, select, input")].filter((own) =>
            own.offsetParent && !own.title && !(own.closest("label") || {}).title
            && !own.closest("dialog")).map((own) => own.outerHTML)"""
        )
        assert mute == []
    assert page.locator("#diagram").bounding_box()["width"] > 0.54 * 1280


def test_a_phone_has_one_column(opened):
    page = opened("whitworth-quick-return", viewport={"width": 360, "height": 780})
    for tab in page.locator("[role=tab]").all():
        tab.click()
        assert page.evaluate("document.documentElement.scrollWidth") == 360
    below = page.locator("#tabs").bounding_box()["y"]
    assert below > page.locator("#drive").bounding_box()["y"]


def test_a_slider_lights_its_dimension_and_its_link_and_back(opened):
    page = opened("four-bar-crank-rocker", **SCREEN)
    lit = "document.querySelectorAll('.dimension.lit').length"
    assert page.evaluate(lit) == 0
    for k, (name, link_name) in enumerate([("a", "crank"), ("b", "coupler"), ("c", "rocker")]):
        page.get_by_label(f"{name} [mm]").hover()
        assert page.evaluate(lit) == 1
        assert page.locator(f".dimension.lit[data-of='{k}']").count() == 1
        bright = page.locator(".bright").evaluate_all("(all) => all.map((own) => own.dataset.id)")
        assert bright
        assert all(text.startswith(f"body-{link_name}") for text in bright)
    page.mouse.move(5, 5)
    assert page.evaluate(lit) == 0
    pointed(page, ".dimension[data-of='3'] .name")
    rows = page.locator(".row.lit label").all_inner_texts()
    assert rows == ["d"]
    page.get_by_role("slider", name="c", exact=True).focus()
    assert page.locator(".dimension.lit[data-of='2']").count() == 1


def test_a_chip_marks_what_is_drawn_of_its_part_alone(opened):
    """Two joints of three links are one pin, which belongs to both."""
    page = opened("gorshkov-seven-link", **SCREEN)
    page.click("#tab-curves")
    for name, drawn in {"joint BE": "joint-BC-BE-pin", "joint E": "joint-E-pin"}.items():
        page.get_by_label("add a curve").select_option(label=name)
        page.locator(".chip").last.hover()
        chosen = page.locator(".chosen").evaluate_all("(all) => all.map((own) => own.dataset.id)")
        assert chosen == [drawn]


LINES = """() => [...document.querySelectorAll(".dimension")].map((own) => [Number(own.dataset.of),
  own.querySelector(".main").getBBox().width])"""


@pytest.mark.parametrize("name", ["four-bar-crank-rocker", "gorshkov-seven-link"])
def test_dimension_lines_are_as_long_as_their_numbers(opened, name):
    """Beside each other the lines are as the numbers, at two poses and after a change."""
    page = opened(name, **SCREEN)
    data = json.loads(page.evaluate("document.getElementById('mechdae').textContent"))
    names = [slider["name"] for slider in data["sliders"]]
    for _ in range(2):
        fields = [number(page.get_by_label(f"{own} [mm]").input_value()) for own in names]
        drawn = page.evaluate(LINES)
        assert {k for k, _ in drawn} == set(range(len(names)))
        ratios = np.array([width / fields[k] for k, width in drawn])
        assert np.ptp(ratios) < 0.01 * ratios.mean()
        page.get_by_label(f"{names[0]} [mm]").fill(str(0.9 * fields[0]))
        page.get_by_label(f"{names[0]} [mm]").press("Enter")
        page.evaluate("mechdae.set({'crank.angle': 0.3})")
        page.wait_for_timeout(60)


def test_a_click_shows_position_velocity_and_acceleration(opened):
    page = opened("four-bar-crank-rocker", **SCREEN)
    page.mouse.click(*middle(page, "[data-id='point-coupler.P']"))
    page.mouse.click(*middle(page, "[data-id='number-coupler']"))
    assert page.locator("#tab-curves").get_attribute("aria-selected") == "true"
    names = page.locator(".chip").all_inner_texts()
    for name, wanted in zip(names, ("3 rocker", "point P", "2 coupler"), strict=True):
        assert name.startswith(wanted)
    titles = page.locator(".chart .title").all_text_contents()
    assert titles == ["φ, °", "s, mm", "ω, rad/s", "v, mm/s", "ε, rad/s²", "a, mm/s²"]
    result = md.solve("four-bar-crank-rocker", "turn")
    marks = page.locator("circle.extreme").count()
    assert marks == 2 * (2 + 2 + 2 + 1 + 2 + 1)  # of each line the largest and the least
    speed = np.linalg.norm(np.asarray(result.points["coupler.P"].velocity), axis=1)
    chart = page.locator(".chart").nth(3).locator("text.extreme").all_text_contents()
    found = sorted(number(text) for text in chart)
    assert found == pytest.approx([1e3 * speed.min(), 1e3 * speed.max()], rel=2e-3)
    page.get_by_role("button", name="remove point P").click()
    assert page.locator(".chip").count() == 2
    assert page.locator(".chart").count() == 3


def test_nothing_is_listed_twice(opened):
    page = opened("four-bar-crank-rocker", **SCREEN)
    page.click("#tab-curves")
    names = page.get_by_label("add a curve").locator("option").all_inner_texts()[1:]
    assert len(set(names)) == len(names)
    assert names == ["1 crank", "2 coupler", "3 rocker", "point B", "point C", "point P"] + [
        f"joint {name}" for name in "ABCD"
    ]


ROWS = """() => [...document.querySelectorAll("#explain tbody tr")].map((row) =>
  [row.dataset.lit, row.cells[1].textContent, row.cells[2].textContent])"""


def gaps(page):
    """Return how far the vectors of each equation miss its end, of all steps, as shares."""
    page.click("#tab-explain")
    found = []
    for _ in range(page.locator("#explain h2").count() * 40):
        page.get_by_role("button", name="Next step").click()
        for table in page.locator("#explain table").all():
            rows = [
                [number(text) for text in row.locator("td").all_inner_texts()[1:3]]
                for row in table.locator("tbody tr").all()
            ]
            vectors = [size * np.exp(1j * np.radians(turn)) for size, turn in rows]
            found.append(abs(sum(vectors[:-1]) - vectors[-1]) / max(map(abs, vectors)))
        if page.locator("#explain h2").inner_text().startswith("1/"):
            break
    return np.array(found)


@pytest.mark.parametrize(
    ("name", "least"), [("four-bar-crank-rocker", 6), ("whitworth-quick-return", 7)]
)
def test_explained_vectors_close(opened, name, least):
    """Terms of each equation add up to its end, Coriolis' term among them, at another pose too."""
    page = opened(name, **SCREEN)
    driver = json.loads(page.evaluate("document.getElementById('mechdae').textContent"))["driver"]
    for value in (0.4, 2.1):
        page.evaluate(f"mechdae.set({{'{driver['name']}': {value}}})")
        found = gaps(page)
        assert len(found) >= least
        assert found.max() < 2e-4


def test_a_wrong_term_does_not_close(browser, pages, tmp_path):
    """With Coriolis' acceleration half as large the equations of the page miss their ends."""
    text = pages["four-bar-crank-rocker"].with_name("whitworth-quick-return.html").read_text()
    script = link.unpacked(text)
    half = '["coriolis", "k", across(v, rider)]'
    wrong = script.replace('["coriolis", "k", turned]', half)
    assert wrong.count(half) == 1
    assert wrong != script
    file = tmp_path / "wrong.html"
    file.write_text(text.replace(link.packed(script), link.packed(wrong)), encoding="utf-8")
    page = browser.new_page(**SCREEN)
    loaded(page, file)
    assert gaps(page).max() > 0.01
    page.close()


def test_explained_numbers_are_those_of_explain(opened):
    page = opened("four-bar-crank-rocker", **SCREEN)
    page.evaluate("mechdae.set({'crank.angle': Math.PI})")
    text = md.explain("four-bar-crank-rocker", "turn", pose=180).text()
    page.click("#tab-explain")
    for _ in range(5):
        page.get_by_role("button", name="Next step").click()
    for name, size, _ in page.evaluate(ROWS):
        kind, letters = name.split("/")[1:]
        high = {"normal": "^n", "tangential": "^τ"}.get(kind, "")
        wanted = re.search(rf"a{re.escape(high)}_{letters} +([\d.]+) mm/s²", text)
        assert wanted is not None, name
        assert number(size) == pytest.approx(float(wanted[1]), rel=1e-4)
    said = page.locator("#explain").inner_text()
    assert "12.354 rad/s²" in said
    assert page.locator("#explain .values sub").all_inner_texts() == ["2", "3"]


def steps(page):
    """Yield the heading of each step of the Explain tab, which is shown."""
    page.click("#tab-explain")
    count = int(page.locator("#explain h2").inner_text().split()[0].split("/")[1])
    for _ in range(count):
        yield page.locator("#explain h2").inner_text()
        page.get_by_role("button", name="Next step").click()


TABLES = """() => [...document.querySelectorAll("#explain table")].map((table) =>
  [...table.querySelectorAll("tbody tr")].map((row) =>
  [row.dataset.lit || "", ...[...row.cells].slice(-3).map((own) => own.textContent)]))"""


def shown_vectors(page):
    """Return the rows of each table shown: name, last three columns as numbers."""
    return [
        [(name, np.array([number(text) for text in texts])) for name, *texts in table]
        for table in page.evaluate(TABLES)
    ]


@pytest.mark.parametrize(("name", "least"), [("rssr", 6), ("delta-robot", 6)])
def test_explained_vectors_of_space_close(opened, name, least):
    """Terms add up to the end of each equation; v and a of points are those of Python."""
    page = opened(name, **SCREEN)
    result, letters = md.solve(name), md.page(name).data["lesson"]["letters"]
    of = {letter: reference for reference, letter in letters.items()}
    closed = compared = 0
    for title in steps(page):
        word = {"velocities": "velocity", "accelerations": "acceleration"}.get(title.split()[-1])
        for rows in shown_vectors(page) if word else ():
            *terms, (end, total) = rows
            size = max(np.abs(vector).max() for _, vector in rows)
            assert np.abs(sum(vector for _, vector in terms) - total).max() < 3e-3 * size
            closed += 1
            wanted = np.asarray(result.points[of[end.split("/")[-1]]][word])[0]
            assert total == pytest.approx(wanted, rel=1e-3, abs=2e-4 * size)
            compared += 1
    assert closed == compared >= least


def test_a_plan_of_space_turns_with_the_view(opened):
    """Arrows of the plan are as long as velocities are seen: from above and from the left."""
    page = opened("rssr", **SCREEN)
    page.click("#tab-plans")
    assert covered(page) == []
    page.locator("#plans select").select_option("1")
    points = md.solve("rssr").points
    speeds = {name[-1]: np.asarray(points[name].velocity)[0] for name in ("crank.B", "rocker.C")}
    for view, axes in (("top", [0, 1]), ("left", [1, 2])):
        page.get_by_label("View").select_option(view)
        long = page.evaluate(
            """() => Object.fromEntries([...document.querySelectorAll("[data-lit^='1/total']")].map(
            (own) => [own.dataset.lit.slice(-1), own.querySelector("path").getBBox().width]))"""
        )
        seen = {letter: float(np.hypot(*speed[axes])) for letter, speed in speeds.items()}
        scale = {letter: long[letter] / size for letter, size in seen.items() if letter in long}
        assert len(scale) == 2
        assert np.ptp([*scale.values()]) < 0.02 * max(scale.values())


@pytest.mark.parametrize("name", ["slider-crank-inertia", "quick-return-friction"])
def test_explained_forces_add_up_and_are_those_of_python(opened, name):
    """Of each link forces and moments add up to nothing; reactions, loads are Python's."""
    page, links = opened(name, **SCREEN), 0
    result = md.solve(name, "cycle")
    mechanism, k = result.mechanism, 20
    (driver,) = result.drivers
    page.evaluate(f"mechdae.set({{'{driver}': {result.drivers[driver].position[k]}}})")
    for title in steps(page):
        if not title.endswith("Forces"):
            continue
        bodies = page.locator("#explain .paper > p > b").all_inner_texts()
        for body, rows in zip(bodies, shown_vectors(page), strict=True):
            *acting, (_, total) = rows
            size = np.abs([row for _, row in acting]).max(axis=0)
            assert (np.abs(sum(row for _, row in acting)) <= 2e-4 * size).all()
            assert (total == 0).all()
            links += 1
            known = dict(acting)
            for joint in mechanism.joints.values():
                if body.split()[1] in joint.bodies:
                    own = np.asarray(result.joints[joint.name].reaction)[k, :2]
                    sign = 1 if joint.second_body == body.split()[1] else -1
                    assert known[f"thing-{joint.name}"][:2] == pytest.approx(sign * own, rel=1e-4)
            for load, wrenches in result.loads.items():
                for other, row in wrenches.items():
                    if other == body.split()[1]:
                        shown = known[f"force/load/{load}/{other}"][:2]
                        assert shown == pytest.approx(row[k][:2], rel=1e-4)
    assert links == len(mechanism.bodies)


def test_a_wrong_force_does_not_add_up(pages, browser, tmp_path):
    """With the inertia of a link reversed the sums of its forces are not nothing."""
    text = pages["slider-crank-inertia"].read_text(encoding="utf-8")
    script = link.unpacked(text)
    wrong = script.replace('kind === "inertia" && data.slow ? 0 : 1', 'kind === "inertia" ? -1 : 1')
    assert wrong != script
    file = tmp_path / "wrong.html"
    file.write_text(text.replace(link.packed(script), link.packed(wrong)), encoding="utf-8")
    page = browser.new_page(**SCREEN)
    loaded(page, file)
    sums = [
        rows[-1][1] for title in steps(page) if "Forces" in title for rows in shown_vectors(page)
    ]
    assert max(np.abs(row[:2]).max() for row in sums) > 10
    page.close()


def test_plans_say_that_all_vectors_are_zero(opened):
    """Two sliders on parallel guides carry a bar: it does not turn, and nothing accelerates."""
    page, zero = opened("carriage", **SCREEN), "all vectors are zero"
    page.click("#tab-plans")
    velocities, accelerations = page.locator("#plans .plan").all_text_contents()
    assert zero not in velocities
    assert accelerations.endswith(zero)
    page.click("#tab-explain")
    for _ in range(6):  # groups without an equation have no plan
        assert not page.locator("#explain .plan").is_visible()
        page.click("#explain button[title='Next step']")


def test_a_force_lights_in_table_plan_and_diagram(opened):
    page = opened("slider-crank-inertia", **SCREEN)
    for title in steps(page):
        if title.startswith("7/"):
            break
    page.locator("[data-lit^='force/load/'][data-lit$='/slider']").first.hover()
    lit = page.locator(".lit").evaluate_all(
        "(all) => all.map((own) => own.closest('#diagram, .plan, table, .formula').tagName)"
    )
    assert sorted(lit) == ["P", "TABLE", "svg", "svg"]


def test_a_vector_lights_in_table_plan_and_diagram(opened):
    page = opened("four-bar-crank-rocker", **SCREEN)
    page.click("#tab-explain")
    for _ in range(4):
        page.get_by_role("button", name="Next step").click()
    assert "velocities" in page.locator("#explain h2").inner_text()
    page.locator("#explain tbody tr").nth(1).hover()
    lit = page.locator(".lit").evaluate_all(
        "(all) => all.map((own) => own.closest('#diagram, .plan, table, .formula').tagName)"
    )
    assert sorted(lit) == ["P", "TABLE", "svg", "svg"]
    names = page.locator(".lit").evaluate_all("(all) => all.map((own) => own.dataset.lit)")
    assert set(names) == {"1/relative/CB"}


def test_circles_of_a_group_meet_in_its_joint(opened):
    page = opened("four-bar-crank-rocker", **SCREEN)
    page.click("#tab-explain")
    for _ in range(3):
        page.get_by_role("button", name="Next step").click()
    assert "C is where two circles meet: about B with radius 120 mm and about D" in (
        page.locator("#explain .meets").inner_text()
    )
    circles = page.locator("circle.locus").evaluate_all(
        "(all) => all.map((own) => ['cx', 'cy', 'r'].map((key) => Number(own.getAttribute(key))))"
    )
    x, y = page.locator("[data-id='joint-C-pin']").evaluate(
        "(own) => { const { e, f } = own.transform.baseVal.consolidate().matrix; return [e, f]; }"
    )
    assert len(circles) == 2
    for cx, cy, r in circles:
        assert np.hypot(x - cx, y - cy) == pytest.approx(r, abs=0.02)


def test_the_sentence_follows_the_numbers(opened):
    """Grashof's sentence is that of the lengths, and what it says is what the path does."""
    page = opened("four-bar-crank-rocker", **SCREEN)
    cases = [
        ({"a": 0.04}, "< p + q = 180 mm, the shortest link is the crank: it turns fully", 0),
        ({"a": 0.07}, "> p + q = 180 mm: no link turns fully", 2),
        ({"a": 0.04, "d": 0.03, "c": 0.115}, "the frame: both links on it turn fully", 0),
        ({"a": 0.04, "d": 0.1, "c": 0.06}, "s + l = p + q = 160 mm: change point", 0),
        (
            {"a": 0.11, "b": 0.03, "c": 0.1, "d": 0.12},
            "the shortest link is the coupler: it turns fully",
            2,
        ),
        ({"a": 0.04, "b": 0.08, "c": 0.08, "d": 0.04}, "crank.angle goes from 0° to 360°", 1),
    ]
    for values, wanted, ends in cases:
        assert page.evaluate(f"mechdae.set({json.dumps(values)})"), values
        assert wanted in page.locator("#sentence").inner_text()
        limits = [end for end in page.evaluate("mechdae.limits()") if end is not None]
        assert len(limits) == ends or "change point" in wanted
        if ends == 2:
            said = page.locator("#sentence").inner_text()
            assert "opens at joint" in said
            ends = re.search(r"from (\S+)° to (\S+)°", said)
            assert ends is not None
            assert np.radians([float(text) for text in ends.groups()]) == pytest.approx(
                limits, abs=1e-4
            )
    page.evaluate("mechdae.set({a: 0.11, b: 0.03, c: 0.1, d: 0.12})")
    widths = page.locator(".strip-bar").evaluate_all(
        "(all) => all.map((own) => [...own.children].reduce((sum, part) =>"
        " sum + parseFloat(part.style.width), 0))"
    )
    assert widths == pytest.approx([100 * 150 / 210, 100], abs=0.05)


def test_centres_and_transmission_angles_are_those_of_python(opened):
    page = opened("four-bar-crank-rocker", **SCREEN)
    driver = md.Driver("crank.angle", at=(1.2,), speed=10.0)
    measures = ("transmission", "instant-centres")
    result = md.solve(
        md.load("four-bar-crank-rocker").mechanism, md.Sweep(driver=driver, measures=measures)
    )
    page.evaluate("mechdae.set({'crank.angle': 1.2})")
    page.get_by_label("Transmission angle").check()
    angle = np.degrees(result.joints["C"].transmission_angle[0])
    assert number(page.locator(".angle-name").text_content()[4:]) == pytest.approx(angle, rel=1e-2)
    page.evaluate("mechdae.set({'crank.angle': 0.7})")  # where its other side is beyond the edge
    sheet, name = (page.locator(own).bounding_box() for own in ("#diagram", ".angle-name"))
    assert name["x"] + name["width"] < sheet["x"] + sheet["width"]
    page.evaluate("mechdae.set({'crank.angle': 1.2})")
    page.get_by_label("Instant centres").check()
    names = page.locator(".centre-name").all_text_contents()
    assert {"P₀₁", "P₁₂", "P₂₃", "P₀₃"} <= set(names)
    spots = dict(
        zip(
            names,
            page.locator("circle.centre").evaluate_all(
                "(all) => all.map((own) => [own.cx.baseVal.value, own.cy.baseVal.value])"
            ),
            strict=True,
        )
    )
    pins = {
        name: page.locator(f"[data-id='joint-{name}-pin']").evaluate(
            "(own) => { const { e, f } = own.transform.baseVal.consolidate().matrix;"
            " return [e, f]; }"
        )
        for name in "ABCD"
    }
    for centre, pin in {"P₀₁": "A", "P₁₂": "B", "P₂₃": "C", "P₀₃": "D"}.items():
        assert spots[centre] == pytest.approx(pins[pin], abs=0.02)
    if "P₀₂" in spots:  # Kennedy: on the lines of both cranks
        for one, two in ("AB", "DC"):
            a, b, p = (np.array(own) for own in (pins[one], pins[two], spots["P₀₂"]))
            across = np.cross(b - a, p - a) / np.hypot(*(b - a))
            assert across == pytest.approx(0, abs=0.2)


def test_wheel_zooms_and_the_ground_pans(opened):
    page = opened("four-bar-crank-rocker", **SCREEN)
    wide = "document.querySelector(\"[data-id='support-D']\").getBoundingClientRect().x"
    wide += " - document.querySelector(\"[data-id='support-A']\").getBoundingClientRect().x"
    before = page.evaluate(wide)
    spot = middle(page, "[data-id='joint-A-pin']")
    page.mouse.move(*spot)
    page.mouse.wheel(0, -250)
    until(page, f"{wide} > {1.5 * before}")
    assert middle(page, "[data-id='joint-A-pin']") == pytest.approx(spot, abs=1)
    page.mouse.move(700, 600)
    page.mouse.down()
    page.mouse.move(650, 580, steps=4)
    page.mouse.up()
    moved = middle(page, "[data-id='joint-A-pin']")
    assert moved == pytest.approx([spot[0] - 50, spot[1] - 20], abs=5)
    page.mouse.dblclick(700, 600)
    until(page, f"Math.abs({wide} - {before}) < 1")


def test_what_can_be_dragged_says_so(opened):
    page = opened("four-bar-crank-rocker", **SCREEN)
    x, y = middle(page, "[data-id='point-coupler.P']")
    cursor = "document.getElementById('diagram').style.cursor"
    page.mouse.move(x + 12, y)
    assert page.evaluate(cursor) == "grab"
    assert page.locator(".ring").is_visible()
    page.mouse.move(x + 60, y - 60)
    assert page.evaluate(cursor) == ""


def test_the_view_tells_what_it_is(opened):
    page = opened("rssr", **SCREEN)
    view = page.get_by_label("View")
    assert view.input_value() == "chosen"
    box = page.locator("#diagram").bounding_box()
    page.mouse.move(box["x"] + 40, box["y"] + 40)
    page.mouse.down()
    page.mouse.move(box["x"] + 90, box["y"] + 60, steps=3)
    page.mouse.up()
    assert view.input_value() == "turned"
    page.locator("#diagram").focus()
    page.keyboard.press("0")
    assert view.input_value() == "chosen"


def test_keys_are_told(opened):
    page = opened("four-bar-crank-rocker", **SCREEN)
    page.locator("#diagram").focus()
    page.keyboard.press("?")
    assert page.get_by_role("dialog").is_visible()
    assert "next assembly mode" in page.get_by_role("dialog").inner_text()
    page.get_by_role("button", name="Close").click()
    assert not page.get_by_role("dialog").is_visible()


def test_modes_are_cards(opened):
    page = opened("four-bar-crank-rocker", **SCREEN)
    page.click("#tab-modes")
    cards = page.locator(".card")
    assert cards.count() == 2
    assert page.locator(".card[aria-pressed=true]").inner_text() == "-"
    assert all(card.locator("path").count() >= 3 for card in cards.all())
    cards.nth(0).click()
    until(page, "mechdae.pose().mode === '+'")
    assert page.locator(".card[aria-pressed=true]").inner_text() == "+"


def test_forces_have_curves(opened):
    page = opened("slider-crank-inertia", **SCREEN)
    page.click("#tab-forces")
    result = md.solve("slider-crank-inertia", "cycle")
    effort = np.asarray(result.efforts["crank.angle"])
    extremes = [
        number(text)
        for text in page.locator("#forces .chart").first.locator("text.extreme").all_text_contents()
    ]
    assert max(extremes) == pytest.approx(np.nanmax(effort), rel=2e-3)
    page.mouse.click(*middle(page, "[data-id='joint-C-pin']"))
    assert "reaction C" in " ".join(page.locator("#forces .chip").all_inner_texts())
    page.click("#tab-plans")
    page.locator("#plans select").select_option(label="forces on II.2 RRP(2,3)")
    kinds = {"reaction": 2, "load": 1, "inertia": 2, "inner": 1}
    for kind, count in kinds.items():
        assert page.locator(f".plan .vector.{kind}").count() == count


def test_a_motion_has_curves_energies_and_events(opened):
    page = opened("coasting-slider-crank", **SCREEN)
    result = md.solve("coasting-slider-crank", "motion")
    ways = (
        page.locator(".chart")
        .first.locator(".event")
        .evaluate_all("(all) => all.map((own) => own.getAttribute('d').split('M').length - 1)")
    )
    assert sum(ways) == len(result.events)
    times: dict[tuple[str, str], list[float]] = {}
    for event in result.events:
        part = getattr(event, "joint", None) or event.name
        times.setdefault((event.kind, part), []).append(float(event.at))
    assert page.locator(".events > *").count() == len(ways) == len(times)
    titles = page.locator(".chart .title").all_text_contents()
    assert {"φ, °", "ω, rad/s", "ε, rad/s²", "energy, J"} == set(titles)
    said = page.locator(".chip").all_inner_texts()
    assert f"{result.scalars['kinetic'][0]:.5g}" in " ".join(said)
    about = page.locator(".event title").first.text_content()
    ((kind, part), at), *_ = times.items()
    assert (kind, at[0]) == ("reversal", pytest.approx(0.1128, rel=1e-3))
    assert about == f"reversal in {part}, {len(at)} times, t = {at[0]:.4g} s to {at[-1]:.4g} s"
    page.click("#tab-dimensions")
    table = page.locator("#dimensions").inner_text()
    assert "m_slider" in table


def test_russian_numbers_have_commas(opened):
    page = opened("russian", **SCREEN)
    for tab in page.locator("[role=tab]").all():
        tab.click()
        text = page.locator("body").inner_text()
        fields = page.locator("input[type=text]").evaluate_all(
            "(all) => all.map((own) => own.value)"
        )
        units = re.findall(r"\d\s?(mm|rad|m/s|rad/s|s)\b", text)
        assert not re.search(r"\d\.\d", text + " ".join(fields))
        assert not units
    field = page.get_by_label("b [мм]", exact=True)
    page.click("#tab-dimensions")
    field.fill("125,5")
    field.press("Enter")
    until(page, "mechdae.toml().includes('b = 0.1255')")
