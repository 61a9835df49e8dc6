"""The page at the widths that it is used at: what is seen, read, hit and reached there, measured in the browser."""

import itertools
from dataclasses import replace
from pathlib import Path

import msgspec
import pytest
from dockpose.app.state.changes import with_method
from dockpose.app.state.view import with_sample

from tests.browser.conftest import LAPTOP, visit

pytestmark = pytest.mark.browser
SIZES = {
    "phone": (390, 844),
    "tablet": (820, 1180),
    "small": (1024, 768),
    "low": (1280, 800),
    "laptop": LAPTOP,
    "desk": (1920, 1080),
    "laptop at 200 %": (683, 384),
}
LEAST = {"leastTargetPx": 32, "leastTextPx": 12, "leastContrast": 4.5}
MEASURE = Path(__file__).with_name("measure.js").read_text(encoding="utf-8")
LEFT, RIGHT = "[data-dock-region=left]", "[data-dock-region=right]"
CANVAS = "canvas[data-engine]"
MARK = """() => {
  const all = "button, input, textarea, a[href], [role=tab], [role=slider], [tabindex='0']";
  const isReachable = (one) => one.checkVisibility({ visibilityProperty: true }) && !one.disabled && one.tabIndex >= 0;
  const targets = [...document.querySelectorAll(all)].filter((one) => isReachable(one) && !one.matches("[type=file]"));
  for (const one of targets) one.dataset.reached = "no";
  return targets.length;
}"""
BAR = ".mantine-ScrollArea-scrollbar[data-orientation=vertical]"
BARS_OVER_TABS = f"""() => {{
  const boxes = (selector) => [...document.querySelectorAll(selector)].map((one) => one.getBoundingClientRect());
  const bars = boxes("{RIGHT} {BAR}").filter((bar) => bar.width > 0);
  const isUnder = (tab) => bars.some((bar) => bar.left < tab.right && bar.right > tab.left && bar.top < tab.bottom - 1);
  return boxes("{RIGHT} [role=tab]").filter(isUnder).map((tab) => [tab.left, tab.right]);
}}"""
# How many controls are in sight: buttons, boxes and sliders, the one of a slider and its box being the same.
IN_SIGHT = """() => {
  const isSeen = (one) => {
    const { left, top, width, height } = one.getBoundingClientRect();
    const hit = document.elementFromPoint(left + width / 2, top + height / 2);
    const isShown = one.checkVisibility({ visibilityProperty: true, opacityProperty: true }) && width > 1 && height > 1;
    return isShown && hit !== null && (one.contains(hit) || hit.contains(one));
  };
  const kinds = "button:not([role=tab]), input:not([type=hidden], [type=file]), select, textarea, [role=slider]";
  const seen = [...document.querySelectorAll(kinds)].filter(isSeen);
  return new Set(seen.map((one) => (one.matches("button") ? one : viserPage.labelOf(one) || one))).size;
}"""
STAGE, PLOT = "dockpose-picture .stage", "dockpose-histogram .plot"
COLUMN = "[data-dock-root]"  # which scrolls as a whole on small screens
PARTS = {"picture": STAGE, "3D": CANVAS, "tools": f"{RIGHT} [role=tablist]:visible"}


def scroll_to(page, part):
    """Scroll to a part of the page, where all stand beneath each other."""
    page.page.locator(PARTS[part]).first.evaluate("one => one.scrollIntoView()")
    page.rest()


def is_column(page):
    return page.page.evaluate("innerWidth < 1100")


def tools(page):
    return page.page.locator(f"{RIGHT} [role=tab]").all_inner_texts()


def open_tool(page, name):
    page.page.locator(RIGHT).get_by_role("tab", name=name, exact=True).click()
    page.rest()


def box(page, selector):
    return page.page.locator(selector).first.evaluate(
        "one => { const { left, top, right, bottom, width, height } = one.getBoundingClientRect();"
        " return { left, top, right, bottom, width, height }; }"
    )


def faults(page):
    """Faults with each tool open, and of what stands above the tools on small screens."""
    found = {}

    def measure(where):
        for fault in page.page.evaluate(MEASURE, LEAST):
            found.setdefault(fault, []).append(where)

    for part in ("picture", "3D") if is_column(page) else ():
        scroll_to(page, part)
        measure(part)
    scroll_to(page, "tools")
    for tool in tools(page):
        open_tool(page, tool)
        measure(tool)
    return found


@pytest.mark.parametrize("size", SIZES.values(), ids=SIZES)
def test_nothing_is_cut_off_covered_faint_or_too_small_to_hit(page, resized, size):
    resized(size)
    assert faults(page) == {}


def test_there_are_five_tabs_and_never_more_controls_in_sight_than_can_be_taken_in(page):
    names = tools(page)
    assert len(names) <= 5
    for name in names:
        open_tool(page, name)
        assert 20 < page.page.evaluate(IN_SIGHT) <= 40, name


@pytest.mark.parametrize("name", ["phone", "tablet", "small"])
def test_all_that_is_touched_is_40_pixels_large(page, browser, name):
    wide, high = SIZES[name]
    with visit(browser, page.app, viewport={"width": wide, "height": high}, has_touch=True, is_mobile=True) as other:
        other.page.goto(f"{page.app.address}&fixedDpr=0.1")
        other.page.locator("dockpose-live #candidates tbody tr").first.wait_for()
        for part in PARTS:
            scroll_to(other, part)
            assert other.page.evaluate(MEASURE, LEAST | {"leastTargetPx": 40}) == [], part


def test_a_finger_on_the_whole_picture_scrolls_the_page_and_pans_one_that_is_zoomed(page, browser):
    wide, high = SIZES["phone"]
    with visit(browser, page.app, viewport={"width": wide, "height": high}, has_touch=True, is_mobile=True) as other:
        other.page.goto(f"{page.app.address}&fixedDpr=0.1")
        other.page.locator("dockpose-live #candidates tbody tr").first.wait_for()
        other.page.locator(f"{STAGE}[data-fits]").wait_for()
        session = other.page.context.new_cdp_session(other.page)
        stage = box(other, STAGE)

        def swipe():
            x, y = stage["left"] + stage["width"] / 2, stage["top"] + stage["height"] / 2
            for number in range(12):
                kind, place = "touchMove" if number else "touchStart", {"x": x, "y": y - 10 * number}
                session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": [place]})
                other.rest()
            session.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
            other.rest()
            return other.page.locator(COLUMN).evaluate("one => one.scrollTop")

        assert swipe() > 40
        assert other.page.locator(f"{STAGE}[data-fits]").count() == 1
        other.page.locator(COLUMN).evaluate("one => one.scrollTo(0, 0)")
        other.page.locator("dockpose-picture [data-do=in]").click()
        assert swipe() == 0


@pytest.mark.parametrize("size", SIZES.values(), ids=SIZES)
def test_no_scroll_bar_lies_over_the_words_of_a_tab(page, resized, size):
    resized(size)
    scroll_to(page, "tools")
    open_tool(page, "Detect")
    page.page.locator(f"{RIGHT} [role=tab]").last.hover()  # bars are there while the pointer is over what scrolls
    if not is_column(page):  # which scrolls with a bar of the browser's, beside it
        page.page.locator(f"{RIGHT} {BAR}").first.wait_for(state="attached")
    page.rest()
    assert page.page.evaluate(BARS_OVER_TABS) == []


@pytest.mark.parametrize("size", [LAPTOP, SIZES["phone"]], ids=["laptop", "phone"])
def test_nothing_is_faint_in_the_dark(page, resized, size):
    resized(size)
    page.page.emulate_media(color_scheme="dark")
    page.page.locator("html[data-mantine-color-scheme=dark]").wait_for(state="attached")
    assert faults(page) == {}


def of_another_camera(view):
    """A scene whose lights half the camera's focal length puts off their places."""
    tilted = with_sample(view, "tilted")
    half = msgspec.structs.replace(tilted.camera, fx=tilted.camera.fx / 2, fy=tilted.camera.fy / 2)
    return replace(tilted, camera=half)


@pytest.mark.parametrize("size", [LAPTOP, SIZES["phone"], SIZES["desk"]], ids=["laptop", "phone", "desk"])
def test_comparison_fits_as_well(page, resized, size):
    resized(size)
    page.tab("Compare")
    page.until(lambda: page.page.locator("dockpose-compare:not([data-old]) .card").count() >= 9)
    page.rest()
    assert page.page.evaluate(MEASURE, LEAST) == []
    page.tab("Picture")


@pytest.mark.parametrize("size", SIZES.values(), ids=SIZES)
@pytest.mark.parametrize("name", ["Log", "Calibrate"])
def test_what_lies_over_the_picture_fits_as_well_and_moves_nothing(page, resized, size, name):
    resized(size)
    page.page.evaluate("document.querySelector('[data-dock-root]').scrollTo(0, 0)")
    places = [box(page, one) for one in (CANVAS, "#candidates")]
    page.tab(name)
    page.rest()
    assert page.page.evaluate(MEASURE, LEAST) == []
    if not is_column(page):
        assert [box(page, one) for one in (CANVAS, "#candidates")] == places
    page.page.evaluate("document.activeElement.blur()")
    page.page.keyboard.press("Escape")
    page.page.locator(STAGE).wait_for()


@pytest.mark.parametrize("size", [LAPTOP, SIZES["phone"], SIZES["laptop at 200 %"]], ids=["laptop", "phone", "200 %"])
def test_time_line_takes_its_room_from_the_rest(page, resized, size):
    page.tab("Source")
    page.choose("Sequence", "simulated sweep")
    page.page.mouse.move(0, 0)  # or a hint comes up while it is measured
    resized(size)
    page.until(lambda: page.page.locator("dockpose-timeline").is_visible() and page.app.wait_until_idle(0.1))
    assert box(page, "#root")["bottom"] == box(page, "dockpose-timeline")["top"]
    assert box(page, "dockpose-timeline")["bottom"] == size[1]
    for part in PARTS if is_column(page) else ["picture"]:
        scroll_to(page, part)
        assert page.page.evaluate(MEASURE, LEAST) == [], part
    page.tab("Source")
    page.choose("Sequence", "(none)")
    page.until(lambda: page.page.locator("dockpose-timeline").is_hidden())


@pytest.mark.parametrize("name", ["laptop", "desk"])
def test_large_screens_show_all_parts_beside_each_other(page, resized, name):
    resized(SIZES[name])
    left, canvas, right = box(page, LEFT), box(page, CANVAS), box(page, RIGHT)
    assert left["left"] == 0
    sliders = box(page, ".main-number")
    assert left["right"] == pytest.approx(canvas["left"], abs=2) == pytest.approx(sliders["left"], abs=2)
    assert sliders["right"] == pytest.approx(right["left"], abs=3)
    assert right["right"] == SIZES[name][0]
    assert canvas["right"] == pytest.approx(right["right"], abs=0.99)  # a canvas has whole pixels
    numbers = box(page, "dockpose-live[name=candidates]")
    assert canvas["bottom"] <= numbers["top"] < numbers["bottom"] <= right["top"]
    (client,) = page.app.server.get_clients().values()

    def has_the_canvas_aspect():
        canvas = box(page, CANVAS)
        return client.camera.aspect == pytest.approx(canvas["width"] / canvas["height"], rel=0.01)

    page.until(has_the_canvas_aspect)


@pytest.mark.parametrize("name", ["phone", "tablet", "small", "laptop at 200 %"])
def test_small_screens_show_all_parts_in_one_column(page, resized, name):
    resized(SIZES[name])
    wide, high = SIZES[name]
    page.tab("Tank")
    page.page.locator(COLUMN).evaluate("one => one.scrollTo(0, 0)")
    buttons = ".view-buttons .mantine-Button-root"
    tools = f"{RIGHT} .main-number", f"{RIGHT} [role=tab]"
    parts = "#strip", "dockpose-jobs", STAGE, PLOT, CANVAS, "#candidates", *tools
    page.until(lambda: box(page, PLOT)["height"] >= 90)
    places = [box(page, part) for part in parts]
    for above, below in itertools.pairwise(places):
        assert above["height"] > 0
        assert above["bottom"] <= below["top"] + 0.5
    for part in (STAGE, CANVAS):
        assert (box(page, part)["left"], box(page, part)["right"]) == (0, wide)
    assert places[4]["bottom"] <= places[-1]["top"]
    assert box(page, buttons)["top"] >= places[3]["bottom"]
    if name in ("tablet", "small"):  # the 3D view ends where the window does
        assert box(page, CANVAS)["bottom"] == pytest.approx(high, abs=1)
        assert box(page, CANVAS)["height"] >= 0.24 * high
    scrolled = page.page.locator(COLUMN)
    assert scrolled.evaluate("one => [one.scrollWidth, one.scrollHeight > one.clientHeight]") == [wide, True]
    page.slider("fx (px)").scroll_into_view_if_needed()
    assert page.slider("fx (px)").evaluate(WHOLE)


def test_a_row_is_taken_on_a_phone(page, resized):
    resized(SIZES["phone"])
    assert page.page.locator("#candidates tbody tr").count() == 3
    for cell in page.page.locator("#candidates tbody tr").first.locator("td").all():
        place = cell.bounding_box()
        assert 0 <= place["x"] <= place["x"] + place["width"] <= SIZES["phone"][0]
    page.tab("Log")
    page.box("New session").fill("on a phone")
    page.rest()
    page.box("New session").press("Enter")
    page.until(lambda: "Started." in page.page.locator("#experiment").inner_text())
    take = page.page.get_by_role("button", name="Take (T)")
    assert take.bounding_box()["height"] >= 48
    take.click()
    page.until(lambda: page.page.get_by_text("Frame 1").count() + page.page.get_by_text("1 row").count() > 0)
    page.choose("Session", "(none)")


def shown_share(page):
    """The share of the window's area that the picture itself has."""
    width, height = page.page.locator("dockpose-picture").evaluate(
        "({ viewport: v }) => [v.width * v.scale, v.height * v.scale]"
    )
    stage = box(page, STAGE)
    assert width <= stage["width"] + 1
    assert height <= stage["height"] + 1
    return width * height / (page.page.evaluate("innerWidth * innerHeight"))


CARD = ("fx (px)", "cx (px)", "cy (px)", "Diameter (cm)", "Number of lights")
LEAST_TRACK_PX = 200
LEAST_SHARES = {"still": {"3D view": 0.2, "picture": 0.42}, "playing": {"3D view": 0.17, "picture": 0.35}}
# Whether all of something is to be seen: within the window and what it scrolls in, and nothing over its middle.
WHOLE = """one => {
  const { left, top, right, bottom, width, height } = one.getBoundingClientRect();
  const scroller = one.closest("#strip, #candidates") ? null : one.closest("[data-scrollarea-viewport]");
  const around = scroller?.getBoundingClientRect();
  const [low, high] = around ? [around.top, around.bottom] : [0, innerHeight];
  const there = document.elementFromPoint(left + width / 2, top + height / 2);
  const isFree = there !== null && (one.contains(there) || there.contains(one));
  return width > 0 && left >= 0 && right <= innerWidth && top >= low && bottom <= high && isFree;
}"""


def in_one_view(page, state="still"):
    """Faults of the six things that a dock's pose hangs on: what is not seen whole, and what is too small."""
    whole = {"verdict": "#strip-trust", "place": "#place", "picture": STAGE, "histogram": PLOT, "poses": "#candidates"}
    faults = [name for name, selector in whole.items() if not page.page.locator(selector).evaluate(WHOLE)]
    kept = page.page.locator("dockpose-histogram .readout")
    faults += [] if kept.evaluate(WHOLE) and "keeps" in kept.inner_text() else ["what the level keeps"]
    boxes = {label: page.row(label).locator("input:not([type=hidden])") for label in CARD}
    faults += [label for label, one in boxes.items() if not one.evaluate(WHOLE)]
    faults += [f"slider {label}" for label in CARD if not page.slider(label).evaluate(WHOLE)]
    canvas, window = box(page, CANVAS), page.page.evaluate("innerWidth * innerHeight")
    shares = {"3D view": canvas["width"] * canvas["height"] / window, "picture": shown_share(page)}
    faults += [f"{name} of {share:.3f}" for name, share in shares.items() if share < LEAST_SHARES[state][name]]
    tracks = [page.row(label).locator(".mantine-Slider-trackContainer").bounding_box()["width"] for label in CARD]
    faults += [f"track of {wide:.0f} px" for wide in tracks if wide < LEAST_TRACK_PX]
    return faults + ([] if box(page, PLOT)["height"] >= 90 else ["low histogram"])


@pytest.mark.parametrize("name", ["laptop", "desk"])
def test_all_that_a_pose_hangs_on_is_in_one_view_when_the_page_opens_and_while_a_film_plays(page, browser, name):
    wide, high = SIZES[name]
    with visit(browser, page.app, viewport={"width": wide, "height": high}) as other:
        other.open()
        for tool in tools(other):
            open_tool(other, tool)
            other.until(lambda: in_one_view(other) == [])
        page.app.change(lambda view: with_method(view, "fixed", 100), reload=True)
        page.page.get_by_role("button", name="Fixed level 100").wait_for()
        page.choose("Sequence", "simulated approach")
        other.page.locator("dockpose-timeline").wait_for()
        other.until(lambda: page.app.view.list_name == "sequence" and in_one_view(other, "playing") == [])
    page.choose("Sequence", "(none)")
    page.page.locator("dockpose-timeline").wait_for(state="hidden")


# Where each part of the page is; of the tools their tabs, which change their weight and so their width.
PLACES = """() => ["#strip", "dockpose-jobs", "dockpose-picture .stage", "dockpose-histogram .plot", "#candidates",
  "canvas[data-engine]", ".view-buttons", "[data-dock-region=right]",
  "[data-dock-region=right] [role=tablist]"].map((part) => {
  const { left, top, width, height } = document.querySelector(part).getBoundingClientRect();
  return [part, ...[left, top, width, height].map(Math.round)];
}).concat([...document.querySelectorAll(".main-number")].map((one) => JSON.stringify(one.getBoundingClientRect())))"""


def settled(page):
    """The places once the page has taken its final shape: the same at two looks after each other."""
    looks = [None, page.page.evaluate(PLACES)]

    def is_same():
        page.page.wait_for_timeout(300)
        looks.append(page.page.evaluate(PLACES))
        return looks[-1] == looks[-2]

    page.until(is_same)
    return looks[-1]


@pytest.mark.parametrize("name", ["low", "laptop", "desk"])
def test_no_part_moves_when_a_tab_is_pressed_on_a_first_visit_and_after_each_reload(page, browser, name):
    wide, high = SIZES[name]
    with visit(browser, page.app, viewport={"width": wide, "height": high}, first=True) as other:
        other.open()
        other.page.locator("dockpose-steps").get_by_role("button", name="Skip").click()
        other.page.locator("dockpose-steps").wait_for(state="hidden")
        before = settled(other)
        assert len(before) == 9 + 5
        for tool in tools(other):
            open_tool(other, tool)
            assert other.page.evaluate(PLACES) == before, tool
        for tool in ("Source", "Detect"):
            open_tool(other, tool)
            other.page.wait_for_function("name => sessionStorage.getItem('dockpose tabs').includes(name)", arg=tool)
            other.page.reload()
            other.page.locator(f"{RIGHT} [role=tab][aria-selected=true]", has_text=tool).wait_for()
            other.page.locator("dockpose-live #candidates tbody tr").first.wait_for()
            assert settled(other) == before


def test_row_of_tabs_stays_in_sight_while_keys_go_through_what_a_tab_holds(page):
    open_tool(page, "Source")
    tabs = page.page.locator(f"{RIGHT} [role=tablist]")
    before = tabs.bounding_box()
    tabs.locator("[aria-selected=true]").focus()
    for _ in range(20):
        page.page.keyboard.press("Tab")
        assert tabs.bounding_box() == before
        assert page.page.evaluate(
            """() => {
              const { top, bottom } = document.activeElement.getBoundingClientRect();
              const isInside = document.activeElement.closest("[data-dock-region=right] [data-scrollarea-viewport]");
              const tabs = document.querySelector("[data-dock-region=right] [role=tablist]").getBoundingClientRect();
              return !isInside || document.activeElement.role === "tab" || bottom <= tabs.top || top >= tabs.bottom - 1;
            }"""
        )


def test_nothing_moves_where_a_chip_and_words_come(page):
    before = box(page, STAGE)
    page.app.change(lambda view: with_method(of_another_camera(view), "fixed", 100), reload=True)
    page.page.get_by_role("button", name="Fixed level 100").wait_for()
    page.until(lambda: page.trust in ("amber", "red"))
    page.rest()
    assert box(page, STAGE) == before


def drag_bar(page, name, dx, dy):
    bar = box(page, f"#bar-{name}")
    x, y = (bar["left"] + bar["right"]) / 2, (bar["top"] + bar["bottom"]) / 2
    page.page.mouse.move(x, y)
    page.page.mouse.down()
    page.page.mouse.move(x + dx, y + dy, steps=4)
    page.page.mouse.up()
    page.rest()


def test_bars_share_the_room_and_each_browser_remembers(page, browser):
    with visit(browser, page.app) as other:
        other.open()
        left, high = box(other, LEFT)["width"], box(other, CANVAS)["height"]
        drag_bar(other, "right", -150, 0)
        drag_bar(other, "scene", 0, -60)
        narrower, lower = box(other, LEFT)["width"], box(other, CANVAS)["height"]
        assert (narrower, lower) == (pytest.approx(left - 150, abs=2), pytest.approx(high - 60, abs=2))
        other.page.reload()
        other.page.locator("dockpose-live #candidates tbody tr").first.wait_for()
        assert box(other, LEFT)["width"] == pytest.approx(narrower, abs=1)
        other.until(lambda: box(other, CANVAS)["height"] == pytest.approx(lower, abs=1))
    assert box(page, LEFT)["width"] == left  # the other browser has its own


def test_bars_are_moved_by_keys_and_their_focus_is_seen(page, browser):
    with visit(browser, page.app) as other:
        other.open()
        wide, high = LAPTOP
        moves = {
            "right": (("ArrowLeft", 0.02), ("ArrowRight", -0.02), ("ArrowUp", 0.0)),
            "scene": (("ArrowUp", -0.02), ("ArrowDown", 0.02), ("ArrowLeft", 0.0)),
        }
        sizes = {
            "right": lambda: 1 - box(other, LEFT)["width"] / wide,
            "scene": lambda: box(other, CANVAS)["height"] / high,
        }
        for name, keys in moves.items():
            bar, size = other.page.locator(f"#bar-{name}"), sizes[name]
            for key, by in keys:
                expected = size() + by
                bar.press(key)
                other.until(lambda size=size, expected=expected: size() == pytest.approx(expected, abs=0.004))
            assert bar.evaluate("one => getComputedStyle(one).outlineStyle") == "solid"
            before = size()
            bar.press("End")
            if name == "right":
                other.until(lambda size=size: size() == pytest.approx(0.6, abs=0.004))
            else:  # the sliders beneath stay in sight, with nothing to spare
                other.until(lambda: high - 8 < box(other, ".main-number >> nth=-1")["bottom"] <= high)
            bar.press("Home")
            other.until(lambda size=size, before=before: size() < before)


def test_3d_view_and_tools_are_put_away_and_come_back(page, browser):
    with visit(browser, page.app) as other:
        other.open()
        tools_at, bar = box(other, RIGHT)["top"], other.page.locator("#bar-scene")
        bar.press("Enter")
        other.until(lambda: box(other, CANVAS)["right"] <= 0)
        assert box(other, RIGHT)["top"] < tools_at - 100
        other.page.reload()
        other.page.locator("dockpose-live #candidates tbody tr").first.wait_for()
        assert box(other, CANVAS)["right"] <= 0
        bar.press("End")  # which brings it back, as Enter does
        other.until(lambda: box(other, CANVAS)["right"] == LAPTOP[0])
        for is_away in (True, False):
            other.page.locator("#bar-right").dblclick(position={"x": 2, "y": 300})
            other.until(lambda is_away=is_away: (box(other, LEFT)["width"] == LAPTOP[0]) == is_away)


def test_everything_is_reached_and_worked_by_keys(page):
    open_tool(page, "Tank")
    page.rest()
    most = page.page.evaluate(MARK)
    page.page.evaluate("document.activeElement.blur()")
    for _ in range(most + 10):
        page.page.keyboard.press("Tab")
        page.page.evaluate("document.activeElement.dataset.reached = 'yes'")
    missed = page.page.evaluate("[...document.querySelectorAll('[data-reached=no]')].map((one) => one.outerHTML)")
    assert missed == []

    right = page.page.locator(RIGHT)
    for key, opened in (("ArrowRight", "Source"), ("ArrowLeft", "Tank")):
        right.locator("[role=tab][aria-selected=true]").press(key)
        page.until(lambda name=opened: right.locator("[role=tab][aria-selected=true]").inner_text() == name)
    for key in ("Enter", " "):
        for name in ("Source", "Tank"):
            right.get_by_role("tab", name=name, exact=True).press(key)
            page.until(lambda name=name: right.locator("[role=tab][aria-selected=true]").inner_text() == name)
    folder = page.page.get_by_role("button", name="Lens distortion", exact=True)
    before = folder.get_attribute("aria-expanded")
    for key, expected in (("Enter", "false" if before == "true" else "true"), (" ", before)):
        folder.press(key)
        page.until(lambda expected=expected: folder.get_attribute("aria-expanded") == expected)


def test_a_tab_that_is_dragged_stays_where_it_is(page):
    tab = page.page.locator(RIGHT).get_by_role("tab", name="Detect", exact=True)
    place = tab.bounding_box()
    page.page.mouse.move(place["x"] + 10, place["y"] + 10)
    page.page.mouse.down()
    page.page.mouse.move(place["x"] - 400, place["y"] + 300, steps=8)
    page.page.mouse.up()
    page.until(lambda: tab.get_attribute("aria-selected") == "true")
    assert tab.bounding_box()["y"] == place["y"]
    assert tab.bounding_box()["x"] == pytest.approx(place["x"], abs=20)  # the one before is no longer in bold
    assert page.page.locator("[data-floating-window]").count() == 0


def test_fit_lies_in_the_3d_view_and_shows_all_again_from_wherever_it_was_turned(page):
    canvas, fit = box(page, CANVAS), page.page.get_by_role("button", name="Fit", exact=True).last
    place = fit.bounding_box()
    assert canvas["left"] < place["x"] < place["x"] + place["width"] < canvas["right"]
    assert canvas["top"] < place["y"] < canvas["top"] + 60
    (client,) = page.app.server.get_clients().values()
    fit.press("Enter")
    page.page.wait_for_timeout(500)
    fitted = client.camera.position.copy()
    client.camera.position = 1.3 * fitted
    page.page.wait_for_timeout(500)
    fit.click()
    page.until(lambda: abs(client.camera.position - fitted).max() < 0.01)


def test_what_is_said_of_software_is_a_line_in_settings_where_it_is_so(page):
    assert page.page.locator("#webgl-software-rendering").is_hidden()
    open_tool(page, "Settings")
    is_software = page.page.evaluate("document.documentElement.hasAttribute('data-software')")
    page.until(lambda: page.page.locator(".software").is_visible() == is_software)


def test_two_fingers_zoom_and_shift_the_picture(page):
    session = page.page.context.new_cdp_session(page.page)
    stage = box(page, STAGE)
    x, y = stage["left"] + stage["width"] / 2, stage["top"] + stage["height"] / 2

    def touch(kind, *places):
        points = [{"x": place[0], "y": place[1], "id": number} for number, place in enumerate(places)]
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    def viewport():
        return page.page.locator("dockpose-picture").evaluate(
            "({ viewport: v }) => [v.scale, ...v.toPicture([v.wide / 2, v.high / 2])]"
        )

    scale, *middle = viewport()
    touch("touchStart", (x - 40, y))
    touch("touchStart", (x - 40, y), (x + 40, y))
    for apart in (60, 80):
        touch("touchMove", (x - apart, y), (x + apart, y))
    page.until(lambda: viewport()[0] == pytest.approx(2 * scale, rel=0.01))
    assert viewport()[1:] == pytest.approx(middle, abs=0.5)
    touch("touchMove", (x - 20, y + 30), (x + 140, y + 30))  # both by 60 to the right and 30 down
    page.until(lambda: viewport()[1] == pytest.approx(middle[0] - 30 / scale, abs=0.5))
    assert viewport()[0] == pytest.approx(2 * scale, rel=0.01)
    assert viewport()[2] == pytest.approx(middle[1] - 15 / scale, abs=0.5)
    touch("touchEnd", (x + 140, y + 30))
    before = viewport()
    touch("touchEnd")
    assert viewport() == before
    touch("touchStart", (x, y))  # one finger shifts, as before
    touch("touchMove", (x + 20, y))
    touch("touchEnd")
    page.until(lambda: viewport()[1] == pytest.approx(before[1] - 10 / scale, abs=0.5))
