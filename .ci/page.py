"""The story of an operator at the web page, in a headless browser, with the shipped tower running behind it.

page.py RIG PICTURES BROWSER: the folder of the processes' states and logs, that of the screenshots, the program. With
BLESS=1 the pictures of the documents are made anew.
"""

import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import time

from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import expect, sync_playwright

RIG, PICTURES = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
BROWSER = sys.argv[3]
DOCUMENTED = pathlib.Path("deploy/pictures")
PROGRAMS = pathlib.Path("target/release")
NETWORK = [f"--connect=tcp/127.0.0.1:{port}" for port in (7447, 7448, 7449)]
ADDRESS = "127.0.0.1:8480"
PAGE = f"http://{ADDRESS}"
GAGE = "module1/sensor/g2"
CYLINDER = "module2/actuator/a4"
OTHER = "module2/sensor/g5"
NOTE = "seen on site, its cable is loose"
SCRIPT = "<script>document.title = 'broken'</script>"
LONG = 60_000
PHONE, DESK = {"width": 390, "height": 844}, {"width": 1440, "height": 1000}

running = {}


def start(name, *command):
    log = open(RIG / f"{name}.log", "ab")
    running[name] = subprocess.Popen([str(word) for word in command], stdout=log, stderr=log)


def run(*words):
    command = [str(PROGRAMS / "trusswatch"), *[str(word) for word in words]]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def start_diagnoser(module):
    program = PROGRAMS / "trusswatch-diagnoser"
    start(module, program, "run", f"configs/{module}.toml", "--state-dir", RIG / module)


def link(person, *words):
    """A link to sign in with."""
    printed = run("web", "link", person, "--state-dir", RIG / "web", "--address", PAGE, *words)
    return re.search(r"http://\S+", printed).group()


def history():
    """Every order that the journals hold."""
    printed = run("history", "--structure", "tower", "--mode", "peer", *NETWORK, "--json")
    entries = json.loads(printed)["transitions"]
    return [entry["order"] for entry in entries if entry.get("order")]


def step(words):
    print(f"-- {words}", flush=True)


class Axed:
    """What axe finds, of every page that it was shown."""

    def __init__(self):
        self.axe, self.pages = Axe(), 0

    def check(self, page, what):
        found = self.axe.run(page)
        self.pages += 1
        if found.violations_count:
            sys.exit(f"axe finds on {what}:\n{found.generate_report()}")


def context(browser, scheme="light", size=DESK, **more):
    return browser.new_context(color_scheme=scheme, viewport=size, **more)


def sign_in(page, url):
    page.goto(url)
    page.get_by_role("button", name=re.compile("sign in", re.I)).click()


def loaded_until(page, path, text):
    """Loads a page until it has the text: what journals hold is read every other second."""
    end = time.monotonic() + 15
    page.goto(PAGE + path)
    while text not in page.locator("main").inner_text():
        assert time.monotonic() < end, f"{path} never had {text}"
        page.goto(PAGE + path)


def line(page, component):
    """The line on a component in the list of what needs attention."""
    return page.locator("#alarms li").filter(has_text=component)


def in_drawing(page, component):
    return page.locator(f'#signs a[href^="/component/{component}"]')


def before_anything(page):
    step("a page with nothing behind it")
    page.goto(PAGE)
    expect(page.locator("body")).to_contain_text("No module answers")
    for place in ("#counts", "#alarms", "#others", "#modules", "#signs"):
        expect(page.locator(place)).not_to_contain_text("normal")


def it_fills(page):
    step("it fills when the structure comes")
    for module in ("module1", "module2"):
        start_diagnoser(module)
    start("plant", PROGRAMS / "trusswatch-plant", "run", "configs/plant.toml")
    expect(page.locator("#counts")).to_contain_text("24 of 24 components verified", timeout=LONG)


def inject(gage, offset_m):
    words = ["inject", gage, "bias", f"--offset-m={offset_m}", "--structure", "tower"]
    run(*words, "--mode", "peer", *NETWORK)


def a_fault_shows(page):
    step("a fault shows in list and drawing within a second, without a reload")
    page.evaluate("window.notReloaded = true")
    inject(GAGE, 1.5e-4)
    injected = time.monotonic()
    expect(line(page, GAGE).first).to_contain_text(re.compile("latched", re.I), timeout=5000)
    expect(in_drawing(page, GAGE)).to_have_class(re.compile("latched"), timeout=5000)
    seen = time.monotonic() - injected
    print(f"seen {seen:.2f} s after it was injected")
    assert seen < 1.0, seen
    assert page.evaluate("window.notReloaded") is True
    expect(line(page, GAGE).first).to_contain_text("bias of", timeout=10_000)


def an_observer_is_refused(browser, axed):
    step("who signs in to look may not order, not even by a request of his own")
    page = context(browser).new_page()
    sign_in(page, link("eve", "--view-only"))
    page.goto(f"{PAGE}/component/{GAGE}")
    expect(page.locator("body")).to_contain_text("eve")
    expect(page.locator("form[action^='/order/']")).to_have_count(0)
    page.goto(f"{PAGE}/sign-out")
    token = page.locator("input[name=token]").get_attribute("value")
    form = {"component": GAGE, "note": "mine", "token": token, "back": "/"}
    answer = page.request.post(
        f"{PAGE}/order/acknowledge", form=form, headers={"Origin": PAGE}, max_redirects=0
    )
    assert answer.status == 403 and "may look" in answer.text(), answer.text()
    page.goto(f"{PAGE}/component/{GAGE}")
    axed.check(page, "a component's page for an observer")
    assert not history()


def ada_acknowledges(browser, axed):
    step("ada signs in and acknowledges; the journal has her name")
    page = context(browser).new_page()
    url = link("ada")
    sign_in(page, url)
    again = context(browser).new_page()
    sign_in(again, url)
    expect(again.locator("body")).to_contain_text(re.compile("used|no longer|not valid|unknown", re.I))
    page.goto(f"{PAGE}/component/{GAGE}")
    axed.check(page, "a component's page with orders")
    form = page.locator("form[action='/order/acknowledge']")
    form.get_by_label(re.compile("note", re.I)).fill(NOTE)
    form.get_by_role("button").click()
    expect(page.locator("body")).to_contain_text(re.compile("acknowledged", re.I))
    expect(page.locator("body")).to_contain_text("ada (through web)", timeout=5000)
    given = [(one["by"], one["on_behalf_of"], one["note"]) for one in history()]
    assert given == [("web", "ada", NOTE)], given
    return page


def ada_shelves(page):
    step("she shelves another; who, why and until when stand in the list")
    page.goto(f"{PAGE}/component/{CYLINDER}")
    form = page.locator("form[action='/order/shelve']")
    form.get_by_label(re.compile("for|how long", re.I)).first.fill("2h")
    form.get_by_label(re.compile("reason|note|why", re.I)).first.fill("valve is being changed")
    form.get_by_role("button").click()
    page.goto(PAGE)
    shelved = page.locator("#others li").filter(has_text=CYLINDER)
    expect(shelved).to_contain_text("ada (through web)")
    expect(shelved).to_contain_text("valve is being changed")


def ada_writes_a_script(page):
    step("a script in a note is text wherever it is shown")
    page.goto(f"{PAGE}/component/{CYLINDER}")
    form = page.locator("form[action='/order/unshelve']")
    form.get_by_label(re.compile("note", re.I)).fill(SCRIPT)
    form.get_by_role("button").click()
    for path in (f"/component/{CYLINDER}", "/history", "/events"):
        loaded_until(page, path, SCRIPT)
        assert page.title() != "broken"


def pictures(browser, axed):
    step("pictures, each looked at by axe")
    pages = {
        "overview": "/",
        "component": f"/component/{GAGE}",
        "module": "/module/module1",
        "history": "/history",
        "events": "/events",
    }
    for look, (scheme, size) in {
        "light": ("light", DESK),
        "dark": ("dark", DESK),
        "phone": ("light", PHONE),
        "phone-dark": ("dark", PHONE),
    }.items():
        page = context(browser, scheme, size).new_page()
        for name, path in pages.items():
            page.goto(PAGE + path)
            expect(page.locator("#live")).to_have_text(re.compile("^(live|as of)"))
            axed.check(page, f"{path}, {look}")
            wide = page.evaluate("document.documentElement.scrollWidth - innerWidth")
            assert wide <= 0, f"{path}, {look}: {wide} pixels do not fit the width"
            page.screenshot(path=PICTURES / f"{name}-{look}.png", full_page=look.startswith("phone"))
    if os.environ.get("BLESS"):
        for name in ("overview-light", "component-dark"):
            shutil.copy(PICTURES / f"{name}.png", DOCUMENTED / f"{name}.png")


def without_script(browser):
    step("whole without the script, and by keyboard")
    page = context(browser, java_script_enabled=False).new_page()
    page.goto(PAGE)
    expect(line(page, GAGE).first).to_contain_text(re.compile("acknowledged", re.I))
    page = context(browser).new_page()
    page.goto(PAGE)
    page.keyboard.press("Tab")
    page.keyboard.press("Enter")
    for _ in range(30):
        page.keyboard.press("Tab")
        if page.evaluate("document.activeElement?.getAttribute('href') ?? ''").startswith("/component/"):
            break
    page.keyboard.press("Enter")
    expect(page).to_have_url(re.compile("/component/"))


def a_diagnoser_dies(page):
    step("a diagnoser is killed: it stands among the alarms, and nothing of it is normal")
    page.goto(PAGE)
    expect(page.locator("#counts")).to_contain_text("verified")
    running["module2"].send_signal(signal.SIGKILL)
    running.pop("module2").wait()
    killed = time.monotonic()
    of_module = page.locator("#alarms li").filter(has=page.locator('a[href^="/module/module2"]'))
    expect(of_module.first).to_be_visible(timeout=10_000)
    print(f"seen {time.monotonic() - killed:.1f} s after it was killed")
    expect(page.locator("#counts")).to_contain_text(re.compile("1[0-2] unknown"), timeout=10_000)
    titles = page.locator('#signs a[href^="/component/module2/"] title').all_text_contents()
    assert titles and not [one for one in titles if "normal" in one], titles
    page.screenshot(path=PICTURES / "overview-silent.png")
    start_diagnoser("module2")
    expect(page.locator("#counts")).not_to_contain_text("unknown", timeout=LONG)


def the_page_dies(page):
    step("the process of the page is ended: what is shown says that it is old")
    running["web"].send_signal(signal.SIGTERM)
    assert running.pop("web").wait(10) == 0
    expect(page.locator("#live")).to_contain_text("NOT LIVE", timeout=15_000)
    start_web()
    expect(page.locator("#live")).not_to_contain_text("NOT LIVE", timeout=LONG)


def start_web():
    command = ["web", "--listen", ADDRESS, "--state-dir", RIG / "web", "--drawing", "configs/tower.toml"]
    start("web", PROGRAMS / "trusswatch", *command, "--structure", "tower", "--mode", "peer", *NETWORK)
    end = time.monotonic() + 30
    while time.monotonic() < end:
        try:
            return subprocess.run(["curl", "-sf", f"{PAGE}/healthz"], check=True, capture_output=True)
        except subprocess.CalledProcessError:
            time.sleep(0.05)
    sys.exit("the page does not serve")


def story(browser):
    axed = Axed()
    page = context(browser).new_page()
    before_anything(page)
    axed.check(page, "a page with nothing behind it")
    it_fills(page)
    a_fault_shows(page)
    an_observer_is_refused(browser, axed)
    adas = ada_acknowledges(browser, axed)
    ada_shelves(adas)
    expect(line(page, GAGE).first).to_contain_text("ada (through web)")
    inject(OTHER, -8e-5)
    expect(line(page, OTHER).first).to_contain_text("bias of", timeout=10_000)
    pictures(browser, axed)
    ada_writes_a_script(adas)
    without_script(browser)
    a_diagnoser_dies(page)
    the_page_dies(page)
    print(f"axe finds nothing on {axed.pages} pages")


def main():
    start_web()
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=BROWSER, args=["--no-sandbox"])
        story(browser)
        browser.close()


try:
    main()
except BaseException:
    for log in sorted(RIG.glob("*.log")):
        print(f"== {log.name}", *log.read_text(errors="replace").splitlines()[-15:], sep="\n", file=sys.stderr)
    raise
finally:
    for process in running.values():
        process.terminate()
    for process in running.values():
        process.wait()
