"""The page in a real browser: read on a wide screen, a phone, in the dark, on paper, by keyboard, and without scripts.

Debian's chromium is driven through its path; where there is none, or no playwright, the tests are skipped.
"""

import re
import shutil

import pytest
import report_inputs
import synthetic

from reacher_shaping.report import html
from reacher_shaping.settings.study import load_study

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
sync_api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="axe is not installed")
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no chromium on the path")
WIDE, PHONE, PAPER = (1300, 900), (390, 844), (690, 980)  # the last is A4 without its margins, at 96 dots an inch


@pytest.fixture(scope="module")
def address(tmp_path_factory):
    folder = tmp_path_factory.mktemp("page")
    study = load_study(report_inputs.ROOT / "config.yaml").model_dump(mode="json")
    path = folder / "report.html"
    path.write_text(html.build(report_inputs.make(folder, study, synthetic.PAPER_GRID, 3)), encoding="utf-8")
    return path.as_uri()


@pytest.fixture(scope="module")
def browser():
    with sync_api.sync_playwright() as play:
        opened = play.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", "--disable-gpu"])
        yield opened
        opened.close()


@pytest.fixture
def visit(browser, address):
    """Open the page: a function of the size of the window and what a browser's context takes."""
    contexts = []

    def open_page(size, where="", **options):
        context = browser.new_context(viewport=dict(zip(("width", "height"), size, strict=True)), **options)
        contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(120_000)
        page.asked = []
        page.on("request", lambda request: page.asked.append(request.url))
        page.on("pageerror", lambda error: page.asked.append(str(error)))
        page.goto(address + where)
        return page

    yield open_page
    for context in contexts:
        context.close()


@pytest.mark.parametrize("size", [WIDE, PHONE])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_page_is_accessible_fits_its_width_and_asks_no_network(visit, size, scheme):
    page = visit(size, color_scheme=scheme)
    page.evaluate("document.querySelectorAll('details').forEach(one => { one.open = true; })")
    page.locator("#success_by_radius .chart svg").wait_for()
    broken = axe.Axe().run(page).response["violations"]
    assert not [(rule["id"], rule["nodes"][0]["html"]) for rule in broken]
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    assert all(url.startswith(("file:", "data:")) for url in page.asked)


def test_dark_readers_get_a_dark_page(visit):
    light, dark = (
        visit(WIDE, color_scheme=scheme).evaluate("getComputedStyle(document.body).backgroundColor")
        for scheme in ("light", "dark")
    )
    assert light == "rgb(255, 255, 255)"
    assert max(int(part) for part in dark.removeprefix("rgb(").rstrip(")").split(",")) < 60


def test_a_row_of_the_claims_shows_value_and_both_verdicts_on_a_phone(visit):
    page = visit(PHONE)
    boxes = [
        page.locator(f"#C1 summary {part}").first.bounding_box()
        for part in (".measured", ".verdict >> nth=0", ".badge >> nth=0", ".verdict >> nth=1", ".badge >> nth=1")
    ]
    for box in boxes:
        assert box["x"] >= 0
        assert box["x"] + box["width"] <= PHONE[0]
    assert boxes[2]["x"] + boxes[2]["width"] <= boxes[4]["x"], "one verdict does not cover the other"


def test_first_column_stays_when_a_table_is_moved_on_a_phone(visit):
    page = visit(PHONE)
    box = page.locator("#table_2 .scroll")
    before = page.locator("#table_2 tbody th").first.bounding_box()["x"]
    box.evaluate("box => { box.scrollLeft = 300; }")
    assert page.locator("#table_2 tbody th").first.bounding_box()["x"] == pytest.approx(before, abs=1)


def test_paper_shows_whole_tables_and_opened_claims(visit):
    page = visit(PAPER)
    page.emulate_media(media="print")
    wider = page.locator("table").evaluate_all(
        "tables => tables.filter(one => one.scrollWidth > innerWidth).map(one => one.caption.textContent)"
    )
    assert wider == []
    assert page.pdf(format="A4").startswith(b"%PDF")
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    assert page.locator("#C1 dl").bounding_box()["height"] > 0


def test_tables_sort_by_keyboard_and_filter(visit):
    page = visit(WIDE)
    rows = page.locator("#table_2 tbody tr")
    head = page.locator("#table_2").get_by_role("button", name="Rank", exact=True)
    head.focus()
    page.keyboard.press("Enter")
    page.wait_for_function("document.querySelector('#table_2 tbody td').textContent.trim() === '17'")
    assert page.locator("#table_2 th[aria-sort]").count() == 1
    page.locator("#table_2 input").fill("decay 200K")
    assert sum(rows.nth(number).is_visible() for number in range(rows.count())) == 3


def test_a_link_opens_its_claim_and_verdicts_filter(visit):
    page = visit(WIDE, "#C3")
    assert page.locator("#C3").get_attribute("open") is not None
    page.locator("#verdicts").select_option("reproduced")
    assert page.locator("#C18").is_visible()
    assert not page.locator("#C3").is_visible()


def opened_chart(page, figure):
    chart = page.locator(f"#{figure} details.chart")
    chart.locator("summary").click()
    chart.locator("svg").wait_for()
    return chart


def test_curves_tell_their_values_and_are_switched_in_the_legend(visit):
    page = visit(WIDE)
    chart = opened_chart(page, "figure_1")
    dots = chart.locator(".mark-symbol.role-mark path")
    assert dots.count() == 6  # the variants of the first setting, one iteration of three
    dots.last.hover(force=True)
    assert "2,048" in page.locator("#vg-tooltip-element").text_content()
    box = chart.locator(".role-legend-label text").first.bounding_box()
    page.mouse.click(box["x"] + 5, box["y"] + 5)
    page.wait_for_function("document.querySelectorAll('#figure_1 .mark-symbol.role-mark path').length === 1")


def test_single_seeds_are_switched_on_beside_the_mean(visit):
    page = visit(WIDE)
    chart = opened_chart(page, "figure_1")
    thin = chart.locator(".mark-line.role-mark path[stroke-width='1']")
    assert thin.count() == 0
    counts = {}
    for choice in ("seed 1", "every seed"):
        chart.locator("select", has_text="mean alone").select_option(label=choice.removeprefix("seed "))
        page.wait_for_timeout(300)
        counts[choice] = thin.count()
    assert counts == {"seed 1": 6, "every seed": 18}  # of six variants of the first setting, three seeds each


def test_success_is_shown_at_the_radius_of_the_slider_and_the_step_asked_for(visit):
    page = visit(PHONE)
    chart = opened_chart(page, "success_by_radius")
    dots = chart.locator(".mark-symbol.role-mark path")
    assert dots.count() == len(synthetic.PAPER_GRID)
    told = [dots.first.get_attribute("aria-label")]
    chart.locator("input[type=range]").fill("30")
    page.wait_for_timeout(300)
    told.append(dots.first.get_attribute("aria-label"))
    chart.locator("select").select_option(label="at the last step")
    page.wait_for_timeout(300)
    told.append(dots.first.get_attribute("aria-label"))
    assert [float(re.search(r"success: ([\d.]+);", said)[1]) for said in told] == [0.4, 0.6, 0.06]
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")


def test_a_dragged_target_starts_an_episode_that_is_told(visit):
    page = visit(WIDE, "#arm")
    page.locator("[data-part=policy]").select_option("controller")
    page.locator("[data-part=longer]").uncheck()
    box = page.locator("[data-part=target]").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x - 30, y + 40)
    page.mouse.up()
    moved = page.locator("[data-part=target]").bounding_box()
    assert moved["x"] - box["x"] == pytest.approx(-30, abs=2)
    page.wait_for_function("document.querySelector('[data-part=count]').textContent.includes('100 %')")
    assert "on the target" in page.locator("[data-part=said]").text_content()


def test_many_episodes_of_an_untrained_network_touch_often_and_end_seldom(visit):
    page = visit(WIDE, "#arm")
    page.locator("[data-part=policy]").select_option("untrained")
    page.locator("[data-part=many]").click()
    touched, ended = re.findall(r"(\d+) %", page.locator("[data-part=count]").text_content())
    assert 8 < int(touched) < 35
    assert int(ended) < 6


def test_arm_counts_a_touch_at_the_radius_that_it_is_given(visit):
    page = visit(WIDE)
    page.evaluate("""() => {
      const place = document.getElementById("player"), all = place.cloneNode(true);
      place.replaceWith(all);  // without the controls that the page gave it
      const none = {gains: [0, 0, 3]}, words = {now: "", count: "{touched} {ended}"};
      arm.mount(all, {policies: {untrained: none, none, controller: none}, radius: 0.5, words});
    }""")
    page.locator("[data-part=many]").click()
    assert page.locator("[data-part=count]").text_content() == "100 % 100 %"


def test_everything_can_be_read_without_scripts(visit):
    page = visit(WIDE, java_script_enabled=False)
    page.locator("#C1 summary").click()
    assert page.locator("#C1 dl").is_visible()
    assert not page.locator("#verdicts").is_visible()
    assert page.locator("#arm .paths svg").count() == 2
    assert not page.locator("#player").is_visible()
