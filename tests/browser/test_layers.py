"""The layers over the picture: which are drawn, in which order, and that the lights are seen through all of them."""

import pytest
from dockpose.app.state.view import with_sample

from tests.browser.conftest import visit

pytestmark = pytest.mark.browser

# How deep any line comes into the circle of a light, in screen pixels; negative if it stays outside.
DEEPEST = """() => {
  const stage = document.querySelector("dockpose-picture .stage");
  const lights = [...stage.querySelectorAll("[data-light]")].map((one) => {
    const [, x, y] = /translate\\((\\S+) (\\S+)\\)/.exec(one.getAttribute("transform"));
    return [Number(x), Number(y), Number(one.querySelector("circle").getAttribute("r"))];
  });
  let deepest = -Infinity;
  for (const line of stage.querySelectorAll(".found > g > path.line, [data-pose] path.line")) {
    const says = line.parentElement.querySelector("title")?.textContent ?? "";
    if (line.matches(".scale, .dropped") || says.startsWith("centre")) continue;
    for (let at = 0; at <= line.getTotalLength(); at += 0.5) {
      const point = line.getPointAtLength(at);
      const depths = lights.map(([x, y, r]) => r - Math.hypot(point.x - x, point.y - y));
      deepest = Math.max(deepest, ...depths);
    }
  }
  return [lights.length, deepest];
}"""
KEYS = {"l": "[data-light]", "e": "path.outline", "1": "[data-pose=A]", "2": "[data-pose=B]"}


def layer(page, selector):
    return page.page.locator(f"dockpose-picture svg.found {selector}")


@pytest.mark.parametrize("name", ["plain", "tilted", "far"])
def test_no_line_runs_through_a_light(page, name):
    page.app.change(lambda view: with_sample(view, name), reload=True)
    page.until(lambda: page.has_found(name) and page.app.wait_until_idle(0.1))
    page.until(lambda: page.page.evaluate(DEEPEST)[0] == 10)  # frames that follow each other are painted otherwise
    count, deepest = page.page.evaluate(DEEPEST)
    assert count == 10
    assert deepest < 0.1


def test_ellipse_lies_over_the_rims_of_the_poses(page):
    order = page.page.locator("dockpose-picture svg.found > *").evaluate_all(
        "all => all.map((one) => one.dataset.pose ?? (one.querySelector('path.outline') ? 'ellipse' : ''))"
    )
    assert [one for one in order if one][:3] == ["B", "A", "ellipse"]


def test_each_layer_goes_and_comes_by_its_key_and_stays_away_over_a_reload(page, browser):
    with visit(browser, page.app) as other:
        other.open()
        layer(other, "[data-light]").first.wait_for()
        stage = other.page.locator("dockpose-picture .stage")
        for key, selector in KEYS.items():
            assert layer(other, selector).count() > 0
            stage.press(key)
            other.until(lambda selector=selector: layer(other, selector).count() == 0)
            if key != "2":
                stage.press(key)
                other.until(lambda selector=selector: layer(other, selector).count() > 0)
        assert layer(other, "[data-pose=Truth]").count() == 0
        stage.press("y")
        other.until(lambda: layer(other, "[data-pose=Truth]").count() == 1)
        other.page.reload()
        layer(other, "[data-pose=Truth]").wait_for(state="attached")
        assert layer(other, "[data-pose=B]").count() == 0
        button = other.page.locator("dockpose-picture [data-do=layer-b]")
        assert button.get_attribute("aria-pressed") == "false"
    assert layer(page, "[data-pose=B]").count() == 1  # this browser's own


def test_ruler_has_a_key_of_its_own(page):
    stage = page.page.locator("dockpose-picture .stage")
    stage.press("u")
    assert page.page.locator("dockpose-picture [data-do=ruler]").get_attribute("aria-pressed") == "true"
    stage.press("Escape")
