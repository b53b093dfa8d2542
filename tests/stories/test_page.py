"""The web page in a real browser, connected to the simulated tower.

Screenshots go to TRUSSWATCH_PICTURES, if set; BLESS=1 regenerates the pictures of the documents.
"""

import json
import os
import re
import shutil
import signal
import time
import urllib.request
from pathlib import Path

import pytest
from axe_playwright_python.sync_playwright import Axe
from conftest import LIMIT_S, PROGRAMS, ROOT, free_ports, needs, trusswatch, until
from playwright.sync_api import expect, sync_playwright

# One long story; on a slow machine it takes three times as long.
pytestmark = pytest.mark.timeout(900)
DOCUMENTED = ROOT / "deploy/pictures"
GAGE = "module1/sensor/g2"
CYLINDER = "module2/actuator/a4"
OTHER = "module2/sensor/g5"
NOTE = "seen on site, its cable is loose"
SCRIPT = "<script>document.title = 'broken'</script>"
PHONE, DESK = {"width": 390, "height": 844}, {"width": 1440, "height": 1000}
LOOKS = {"light": ("light", DESK), "dark": ("dark", DESK), "phone": ("light", PHONE), "phone-dark": ("dark", PHONE)}


class Site:
    """The processes of the page and the tower, and a browser that opens the page."""

    def __init__(self, rig, browser):
        self.rig, self.browser, self.axe = rig, browser, Axe()
        self.configs = rig.with_free_ports()
        self.address = f"http://127.0.0.1:{free_ports(1)[0]}"
        network = [f"--connect={endpoint}" for endpoint in rig.endpoints()]
        self.network = ["--structure", "tower", "--mode", "peer", *network]
        self.entry_points = dict(zip(rig.ports, network))
        self.state = ["--state-dir", rig.folder / "web"]
        self.pictures = Path(os.environ.get("TRUSSWATCH_PICTURES", rig.folder / "pictures"))

    def serve(self):
        listen = ["--listen", self.address.removeprefix("http://"), "--drawing", "configs/tower.toml"]
        self.rig.start("web", PROGRAMS / "trusswatch", "web", *listen, *self.state, *self.network)

        def serves():
            try:
                return urllib.request.urlopen(f"{self.address}/healthz", timeout=LIMIT_S).status == 200
            except OSError:
                return False

        until("the page is served", serves)

    def page(self, path="/", scheme="light", size=DESK, **more):
        """A page in a fresh browser without a session."""
        page = self.browser.new_context(color_scheme=scheme, viewport=size, base_url=self.address, **more).new_page()
        page.goto(path)
        return page

    def link(self, person, *words):
        """A sign-in link."""
        return re.search(r"http://\S+", trusswatch("web", "link", person, *self.state, "--address", self.address, *words))[0]

    def signed_in(self, link):
        page = self.page(link)
        page.get_by_role("button", name=re.compile("sign in", re.I)).click()
        return page

    def inject(self, gage, offset_m):
        trusswatch("inject", gage, "bias", f"--offset-m={offset_m}", *self.network)

    def orders(self):
        """Every command in the journals: operator, person and reason."""
        entries = json.loads(trusswatch("history", *self.network, "--json"))["transitions"]
        orders = [entry["order"] for entry in entries if entry.get("order")]
        return [(order["by"], order["on_behalf_of"], order["note"]) for order in orders]

    def is_accessible(self, page):
        found = self.axe.run(page)
        assert not found.violations_count, f"{page.url}: {found.generate_report()}"


@pytest.fixture
def site(rig):
    needs("chromium")
    expect.set_options(timeout=1000 * LIMIT_S)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        yield Site(rig, browser)
        browser.close()


def attention(page, component):
    """The first line about a component in the list of alarms."""
    return page.locator("#alarms li").filter(has_text=component).first


def test_an_operator_handles_faults_on_the_page(site):
    site.serve()
    page = site.page()
    with_nothing_behind_it(site, page)
    it_fills_when_the_structure_comes(site, page)
    a_fault_is_shown_within_a_second(site, page)
    an_observer_is_refused(site)
    adas = ada_acknowledges(site)
    ada_shelves(adas)
    expect(attention(page, GAGE)).to_contain_text("ada (through web)")
    background = hidden(site)
    listening = who_wants_signals(site)
    site.inject(OTHER, -8e-5)
    expect(attention(page, OTHER)).to_contain_text("bias of", timeout=10_000)
    expect(background).to_have_title(re.compile(r"^\([2-9]\) "))
    a_further_alarm_is_signalled_once(listening)
    every_look_is_accessible_and_fits(site)
    the_wall_is_read_from_afar_on_one_screen(site)
    phone = grace_acknowledges_on_her_phone(site)
    a_script_in_a_note_is_text(adas)
    what_was_typed_survives_a_session(site, adas)
    what_is_repaired_is_ready_to_reset(site, adas)
    without_script_and_by_keyboard(site)
    a_killed_diagnoser_is_among_the_alarms(site, page)
    what_happened_can_be_printed(site)
    a_page_whose_server_has_ended_says_that_it_is_old(site, page)
    her_phone_stays_signed_in_until_it_is_signed_out(site, phone)


def with_nothing_behind_it(site, page):
    expect(page.locator("#network")).to_contain_text("none of its entry points to the network answers")
    expect(page.locator("#live")).to_contain_text("NOT LIVE")
    for place in ("#counts", "#alarms", "#others", "#modules", "#signs"):
        expect(page.locator(place)).not_to_contain_text("normal")
    site.is_accessible(page)


def it_fills_when_the_structure_comes(site, page):
    site.rig.diagnoser("module1", site.configs)
    site.rig.diagnoser("module2", site.configs)
    site.rig.plant(site.configs)
    expect(page.locator("#counts")).to_contain_text("24 of 24 components are normal")


def a_fault_is_shown_within_a_second(site, page):
    """The list and the drawing update without a reload."""
    page.evaluate("window.notReloaded = true")
    site.inject(GAGE, 1.5e-4)
    injected = time.monotonic()
    expect(attention(page, GAGE)).to_contain_text(re.compile("latched", re.I))
    expect(page.locator(f'#signs a[href^="/component/{GAGE}"]')).to_have_class(re.compile("latched"))
    assert time.monotonic() - injected < 1.0
    assert page.evaluate("window.notReloaded") is True
    expect(attention(page, GAGE)).to_contain_text("bias of", timeout=10_000)


def an_observer_is_refused(site):
    """A view-only session cannot issue commands, even with a forged request."""
    page = site.signed_in(site.link("eve", "--view-only"))
    page.goto(f"/component/{GAGE}")
    expect(page.locator("body")).to_contain_text("eve")
    expect(page.locator("form[action^='/order/']")).to_have_count(0)
    page.goto("/sign-out")
    token = page.locator("input[name=token]").get_attribute("value")
    form = {"component": GAGE, "note": "mine", "token": token, "back": "/"}
    answer = page.request.post("/order/acknowledge", form=form, headers={"Origin": site.address}, max_redirects=0)
    assert answer.status == 403 and "read-only access" in answer.text(), answer.text()
    page.goto(f"/component/{GAGE}")
    site.is_accessible(page)
    assert not site.orders()


def ada_acknowledges(site):
    """The operator's link works once, and the journal records her name."""
    link = site.link("ada")
    page = site.signed_in(link)
    again = site.signed_in(link)
    expect(again.locator("body")).to_contain_text(re.compile("used|no longer|not valid|unknown", re.I))
    page.goto(f"/component/{GAGE}")
    site.is_accessible(page)
    form = page.locator("form[action='/order/acknowledge']")
    form.get_by_label(re.compile("note", re.I)).fill(NOTE)
    form.get_by_role("button").click()
    expect(page.locator("body")).to_contain_text(re.compile("acknowledged", re.I))
    expect(page.locator("body")).to_contain_text("ada (through web)")
    assert site.orders() == [("web", "ada", NOTE)]
    return page


def ada_shelves(page):
    page.goto(f"/component/{CYLINDER}")
    form = page.locator("form[action='/order/shelve']")
    form.get_by_label(re.compile("for|how long", re.I)).first.fill("2h")
    form.get_by_label(re.compile("reason|note|why", re.I)).first.fill("valve is being changed")
    form.get_by_role("button").click()
    page.goto("/")
    shelved = page.locator("#others li").filter(has_text=CYLINDER)
    expect(shelved).to_contain_text("ada (through web)")
    expect(shelved).to_contain_text("valve is being changed")


def hidden(site):
    """A page in the background; it tells of the one alarm."""
    page = site.page()
    expect(page).to_have_title(re.compile(r"^\(1\) "))
    page.evaluate("""() => {
        Object.defineProperty(document, "hidden", { value: true });
        document.dispatchEvent(new Event("visibilitychange"));
    }""")
    return page


def who_wants_signals(site):
    """A page that notifies by the browser and with a sound, of further alarms only."""
    page = site.page(permissions=["notifications"])
    page.add_init_script("""
        window.signals = [];
        window.Notification = class extends Notification {
            constructor(title, options) { super(title, options); signals.push(`${title}: ${options.body}`); }
        };
        const start = OscillatorNode.prototype.start;
        OscillatorNode.prototype.start = function (...at) { signals.push("tone"); return start.apply(this, at); };
    """)
    page.reload()
    expect(page).to_have_title(re.compile(r"^\(1\) "))
    page.get_by_label("Signal of new alarms").select_option("sound")
    # Whoever turns the sound on hears it.
    page.wait_for_function("signals.length === 3")
    return page


def a_further_alarm_is_signalled_once(page):
    page.wait_for_function("signals.length >= 7")
    signals = page.evaluate("signals")
    [said] = [signal for signal in signals if signal != "tone"]
    assert re.match(r"\([2-9]\) ", said) and OTHER in said, signals
    assert len(signals) == 7, signals
    page.get_by_label("Signal of new alarms").select_option("off")
    page.context.close()


def every_look_is_accessible_and_fits(site):
    """Light and dark, desktop and phone; each saves a picture."""
    paths = {
        "overview": "/",
        "component": f"/component/{GAGE}",
        "module": "/module/module1?trend=hour",
        "history": "/history",
        "events": "/events",
        "report": "/report",
    }
    for look, (scheme, size) in LOOKS.items():
        page = site.page("/", scheme, size)
        for name, path in paths.items():
            page.goto(path)
            expect(page.locator("#live")).to_have_text(re.compile("^(live|as of)"))
            site.is_accessible(page)
            excess = page.evaluate("document.documentElement.scrollWidth - innerWidth")
            assert excess <= 0, f"{path}, {look}: {excess} pixels do not fit the width"
            page.screenshot(path=site.pictures / f"{name}-{look}.png", full_page=look.startswith("phone"))
    if os.environ.get("BLESS"):
        for name in ("overview-light", "component-dark"):
            shutil.copy(site.pictures / f"{name}.png", DOCUMENTED)


def the_wall_is_read_from_afar_on_one_screen(site):
    for name, (width, height) in {"720": (1280, 720), "1080": (1920, 1080), "4k": (3840, 2160)}.items():
        page = site.page("/wall", size={"width": width, "height": height})
        expect(page.locator("#verdict h1")).to_contain_text("incident")
        measured = page.evaluate("""() => {
            const of = (selector) => document.querySelector(selector).getBoundingClientRect();
            const letters = parseFloat(getComputedStyle(document.querySelector("#verdict h1")).fontSize);
            const root = document.scrollingElement;
            return { letters, near: of("#incidents .near"), drawing: of(".wall .drawing"), scrolls: root.scrollHeight > root.clientHeight };
        }""")
        assert measured["letters"] >= 48 * height / 1080 - 16 and not measured["scrolls"], (name, measured)
        assert height < 1080 or measured["letters"] >= 48, measured
        assert measured["near"]["height"] >= height / 10 and measured["near"]["bottom"] <= height, (name, measured)
        assert measured["drawing"]["height"] >= height / 2 and measured["drawing"]["bottom"] <= height, (name, measured)
        expect(page.locator(".legend")).to_have_count(0)
        expect(page.locator("#live")).to_contain_text("live")
        site.is_accessible(page)
        site.pictures.mkdir(parents=True, exist_ok=True)
        page.screenshot(path=site.pictures / f"wall-{name}.png")
        page.context.close()


def grace_acknowledges_on_her_phone(site):
    """In the list, at the thumb; her device stays signed in."""
    page = site.page(site.link("grace"), size=PHONE, has_touch=True, is_mobile=True)
    page.get_by_label("Keep this device signed in").check()
    page.get_by_role("button", name=re.compile("sign in", re.I)).tap()
    row = attention(page, OTHER)
    expect(row.get_by_role("button", name="Acknowledge")).to_be_visible()
    assert page.evaluate("document.querySelector('.acknowledge button').getBoundingClientRect().height") >= 44
    row.get_by_role("checkbox").check()
    page.locator("#several").get_by_label("Note").fill("on my way")
    # The list is updated every second meanwhile; what is selected stays so.
    page.wait_for_timeout(2500)
    expect(row.get_by_role("checkbox")).to_be_checked()
    site.is_accessible(page)
    page.screenshot(path=site.pictures / "phone-acknowledge.png")
    page.locator("#several").get_by_role("button").tap()
    expect(page.locator(".message")).to_contain_text(re.compile("acknowledged", re.I))
    expect(attention(page, OTHER).get_by_role("button")).to_have_count(0)
    assert ("web", "grace", "on my way") in site.orders()
    assert "grace" in trusswatch("web", "devices", *site.state)
    return page


def what_was_typed_survives_a_session(site, page):
    """The session ends while an order is written; after signing in again the words are still there."""
    path = f"/component/{CYLINDER}"
    page.goto(path)
    form = page.locator("form[action='/order/shelve']")
    form.get_by_label(re.compile("reason", re.I)).fill("the pump is being changed")
    page.context.clear_cookies()
    form.get_by_role("button").click()
    expect(page.locator("body")).to_contain_text("sign in first")
    page.goto(site.link("ada").removeprefix(site.address))
    page.get_by_role("button", name=re.compile("sign in", re.I)).click()
    page.goto(path)
    expect(form.get_by_label(re.compile("reason", re.I))).to_have_value("the pump is being changed")


def what_is_repaired_is_ready_to_reset(site, page):
    """Standing, returned, reset: each is told from the others in the list."""
    page.goto("/")
    expect(attention(page, OTHER)).not_to_contain_text("ready to reset")
    trusswatch("inject", OTHER, "--repair", *site.network)
    expect(attention(page, OTHER)).to_contain_text("ready to reset", timeout=60_000)
    page.goto(f"/component/{OTHER}")
    page.locator("form[action='/order/reset']").get_by_role("button").click()
    expect(page.locator(".message:not(.refused)")).to_contain_text("reset")
    page.goto("/")
    expect(attention(page, OTHER)).to_have_count(0)


def what_happened_can_be_printed(site):
    """The report of the period, and the page of a fault."""
    page = site.page("/report")
    faults = page.get_by_role("region", name="Faults").locator("tbody tr")
    expect(faults.filter(has_text=GAGE)).to_contain_text("by ada")
    expect(faults.filter(has_text=OTHER)).to_contain_text("by grace")
    expect(page.locator(".notes")).to_contain_text("module2")
    site.is_accessible(page)
    page.pdf(path=site.pictures / "report.pdf")
    page.screenshot(path=site.pictures / "report.png", full_page=True)
    faults.filter(has_text=OTHER).get_by_role("link").click()
    expect(page.locator("h1")).to_contain_text("bias of")
    expect(page.locator("table.history")).to_contain_text("on my way")
    expect(page.locator(".place")).to_contain_text("level")
    site.is_accessible(page)
    page.emulate_media(media="print")
    page.screenshot(path=site.pictures / "incident-print.png", full_page=True)
    # Event by event, the drawing is what it was.
    page = site.page("/replay")
    expect(page.locator("#signs a.latched, #signs a.acknowledged")).not_to_have_count(0)
    page.locator("ol.log li").filter(has_text=GAGE).filter(has_text="latched").get_by_role("link").click()
    expect(page.locator(f'#signs a[href^="/component/{GAGE}"]')).to_have_class(re.compile("latched"))
    expect(page.locator(f'#signs a[href^="/component/{OTHER}"]')).not_to_have_class(re.compile("latched|acknowledged"))
    site.is_accessible(page)
    page.screenshot(path=site.pictures / "replay.png", full_page=True)
    before = page.locator("p.headline").inner_text()
    page.get_by_role("button", name="play").click()
    expect(page.locator("p.headline")).not_to_have_text(before)
    page.get_by_role("button", name="pause").click()


def her_phone_stays_signed_in_until_it_is_signed_out(site, page):
    """Also over a restart of the page."""
    page.goto("/")
    expect(page.locator("#person")).to_contain_text("grace")
    assert "1 signed out" in trusswatch("web", "devices", "--sign-out", "grace", *site.state)
    page.goto("/")
    expect(page.locator("#person")).to_contain_text("sign in")


def a_script_in_a_note_is_text(page):
    page.goto(f"/component/{CYLINDER}")
    form = page.locator("form[action='/order/unshelve']")
    form.get_by_label(re.compile("note", re.I)).fill(SCRIPT)
    form.get_by_role("button").click()

    def has_it(path):
        page.goto(path)
        return SCRIPT in page.locator("main").inner_text()

    for path in (f"/component/{CYLINDER}", "/history", "/events"):
        until(f"the note on {path}", lambda: has_it(path))
        assert page.title() != "broken"


def without_script_and_by_keyboard(site):
    page = site.page(java_script_enabled=False)
    expect(attention(page, GAGE)).to_contain_text(re.compile("acknowledged", re.I))
    page = site.page()
    page.keyboard.press("Tab")
    page.keyboard.press("Enter")
    for _ in range(30):
        page.keyboard.press("Tab")
        if page.evaluate("document.activeElement?.getAttribute('href') ?? ''").startswith("/component/"):
            break
    page.keyboard.press("Enter")
    expect(page).to_have_url(re.compile("/component/"))


def a_killed_diagnoser_is_among_the_alarms(site, page):
    """No component of its module is shown as normal."""
    page.goto("/")
    expect(page.locator("#counts")).to_contain_text("are normal")
    site.rig.end("module2", signal.SIGKILL)
    of_module = page.locator("#alarms li").filter(has=page.locator('a[href^="/module/module2"]'))
    expect(of_module.first).to_be_visible(timeout=10_000)
    expect(page.locator("#counts")).to_contain_text(re.compile("1[0-2] unknown"), timeout=10_000)
    titles = page.locator('#signs a[href^="/component/module2/"] title').all_text_contents()
    assert titles and not [title for title in titles if "normal" in title], titles
    page.screenshot(path=site.pictures / "overview-silent.png")
    history = site.page("/history?module=module2")
    expect(history.locator(".notes")).to_contain_text("what follows is what this page heard of it")
    expect(history.locator("table.history")).to_contain_text("module2")
    expect(history.locator("table.history")).to_contain_text("GONE")
    site.rig.diagnoser("module2", site.configs)
    expect(page.locator("#counts")).not_to_contain_text("unknown")


def a_page_whose_server_has_ended_says_that_it_is_old(site, page):
    assert site.rig.end("web") == 0
    expect(page.locator("#live")).to_contain_text("NOT LIVE", timeout=15_000)
    site.serve()
    expect(page.locator("#live")).not_to_contain_text("NOT LIVE")


def test_a_page_that_is_cut_off_says_so_and_blames_no_module(site):
    for module in ("module1", "module2"):
        site.rig.diagnoser(module, site.configs)
    site.rig.plant(site.configs)
    all_peers = site.network
    site.network = ["--structure", "tower", site.entry_points["module1"]]
    site.serve()
    page = site.page()
    expect(page.locator("#counts")).to_contain_text("24 of 24 components are normal")
    # The only entry point is killed: that is not known of the others, and nothing is known of them.
    site.rig.end("module1", signal.SIGKILL)
    expect(page.locator("#live")).to_contain_text("NOT LIVE: cut off", timeout=10_000)
    expect(page.locator("#network")).to_contain_text("none of its entry points")
    expect(page.locator("#counts")).to_contain_text("24 unknown")
    for _ in range(20):
        shown = page.locator("body").inner_text()
        assert not re.search("NOT ANSWERING|GONE|is not heard|left the network", shown), shown
        page.wait_for_timeout(250)
    page.screenshot(path=site.pictures / "overview-cut-off.png")
    site.is_accessible(page)
    site.rig.diagnoser("module1", site.configs)
    expect(page.locator("#live")).to_contain_text(re.compile("^live"))
    expect(page.locator("#counts")).to_contain_text("24 of 24 components are normal")
    # Of two entry points one is left: the page stays, and the dead one is the dead one.
    site.rig.end("web")
    site.network.append(site.entry_points["module2"])
    site.serve()
    page.reload()
    expect(page.locator("#counts")).to_contain_text("24 of 24 components are normal")
    site.rig.processes["module1"].send_signal(signal.SIGSTOP)
    of_module = page.locator("#alarms li").filter(has=page.locator('a[href^="/module/module1"]'))
    expect(of_module.first).to_contain_text("NOT ANSWERING", timeout=15_000)
    expect(page.locator("#live")).to_contain_text(re.compile("^live"), timeout=15_000)
    assert "module2" not in page.locator("#alarms").inner_text()
    # A command that starts now takes the one that answers.
    seen = trusswatch("faults", *site.network, "--json", check=False)
    modules = {module["module"]: module for module in json.loads(seen.stdout)["modules"]}
    assert not seen.stderr and modules["module2"]["answers"], seen
    site.network = all_peers
