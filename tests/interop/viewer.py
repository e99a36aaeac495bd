"""Looks at pages of `trainer render view` in headless Chromium, without a GPU.

    python3 tests/interop/viewer.py [TRAINER] [PICTURES]

Playwright is installed from PyPI into an environment of its own in target/; Chromium is the system's. A page
with a recipe of every model is opened from its file: light and camera are dragged, by mouse, finger and keys; a slider is
moved and a reading switched off; and every fit is compared with that of `trainer fit` by the same readings. PICTURES is a folder for
screenshots.
"""
import json, math, os, shutil, subprocess, sys, tempfile, time, venv
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
ENVIRONMENT = ROOT / "target" / "viewer"
RECIPES = ROOT / "trainer" / "recipes"
MATERIAL = "procedural:1:77"
# What fits may differ by, relative to the largest of their values; frames a second while a finger moves.
TOLERANCE, LEAST_FRAMES = 1e-5, 10


def enter_environment():
    """Goes on in the environment, which is made if it is not there."""
    python = ENVIRONMENT / "bin" / "python"
    if not python.exists():
        venv.create(ENVIRONMENT, with_pip=True)
    subprocess.run([python, "-m", "pip", "install", "--quiet", "playwright"], check=True)
    os.execv(python, [str(python), __file__, *sys.argv[1:], "--inside"])


def run(*words):
    print("==", *words, flush=True)
    subprocess.run([str(word) for word in words], check=True, stdout=subprocess.DEVNULL)


def compare_fits(page, trainer, recipes, step):
    """What the page has found from its readings, beside what the trainer finds from them."""
    worst = 0
    for index, recipe in enumerate(recipes):
        Path("readings.csv").write_text(page.evaluate(f"glimpse.methods[{index}].csv()"))
        out = Path(f"{step}-{index}")
        run(trainer, "fit", recipe, "--measurements", "readings.csv", "--keep-all", "--out", out)
        material = json.loads((out / "material.json").read_text())
        found, expected = page.evaluate(f"glimpse.methods[{index}].values()"), material["values"]
        assert len(found) == len(expected) > 0, (recipe, len(found), len(expected))
        largest = max(map(abs, expected))
        off = max(abs(one - other) for one, other in zip(found, expected)) / largest
        worst = max(worst, off)
        assert off <= TOLERANCE, (recipe, step, off)
    print(f"{step}: values differ by {worst:.1e} at most")


def settle(page):
    page.wait_for_function("glimpse.isResting()")
    page.wait_for_timeout(50)


def pixels(page):
    """The pictures of all spheres."""
    settle(page)
    return page.evaluate("[...document.querySelectorAll('.ball canvas')].map((canvas) => canvas.toDataURL())")


def fits_across(page):
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth"), "the page is wider than the window"


def drag(page, seconds=3):
    """Drags the light in circles; returns frames a second."""
    box = page.locator(".ball").first.bounding_box()
    x, y, radius = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2, box["width"] / 4
    page.mouse.move(x, y)
    page.mouse.down()
    before, start, step = page.evaluate("glimpse.frames()"), time.monotonic(), 0
    while time.monotonic() - start < seconds:
        page.mouse.move(x + radius * math.cos(step / 9), y + radius * math.sin(step / 9))
        step += 1
    # At the end of all that was asked for, so that nothing is counted that was not drawn in time.
    frames = page.evaluate("glimpse.frames()") - before
    seconds = time.monotonic() - start
    page.mouse.up()
    return frames / seconds


def look_at_desktop(page, trainer, recipes, masked):
    compare_fits(page, trainer, recipes, "as-read")
    before = pixels(page)
    frames = drag(page)
    print(f"{frames:.1f} frames a second while the light of {len(recipes) + 1} spheres is dragged")
    assert frames >= LEAST_FRAMES, frames
    lit = pixels(page)
    assert all(one != other for one, other in zip(before, lit)), "the light moved, and a sphere did not change"

    # The camera, by the right button and by keys; and back again.
    ball = page.locator(".ball").first
    box = ball.bounding_box()
    page.mouse.move(box["x"] + 80, box["y"] + 80)
    page.mouse.down(button="right")
    page.mouse.move(box["x"] + 130, box["y"] + 90, steps=4)
    page.mouse.up(button="right")
    ring = "document.querySelector('.ball i').style.left"
    settle(page)
    assert page.evaluate(ring) != "50%", "the camera did not move"
    ball.focus()
    page.keyboard.press("Home")
    settle(page)
    assert page.evaluate(ring) == "50%"
    assert pixels(page) == before, "home is elsewhere"
    page.keyboard.press("ArrowLeft")
    assert pixels(page) != before, "keys do not move the light"
    page.keyboard.press("Home")

    # Sliders of every method: only its own sphere changes.
    picks = page.locator(".pick")
    for index in range(len(recipes)):
        before = pixels(page)
        losses = page.evaluate("glimpse.methods.map((method) => method.loss())")
        picks.nth(index).click()
        slider = page.locator("#readings input[type=range]").nth(1)
        slider.focus()
        for _ in range(25):
            page.keyboard.press("ArrowRight")
        changed = [one != other for one, other in zip(before, pixels(page))]
        assert changed == [place == index + 1 for place in range(len(recipes) + 1)], changed
        assert page.evaluate("glimpse.methods.map((method) => method.loss())")[index] != losses[index]
    compare_fits(page, trainer, recipes, "moved")
    picks.nth(masked).click()
    boxes = page.locator("#readings input[type=checkbox]")
    for index in (0, 3, 7):
        boxes.nth(index).click()
    settle(page)
    assert page.evaluate(f"glimpse.methods[{masked}].csv()").count(",,,,brdf\n") == 3
    compare_fits(page, trainer, recipes, "some-missing")
    for index in range(boxes.count()):
        if boxes.nth(index).is_checked():
            boxes.nth(index).click()
    settle(page)
    assert page.locator("#refused").is_visible(), "a fit of nothing is not refused"
    page.locator("#reset").click()
    settle(page)
    assert page.locator("#refused").is_hidden()


def main(trainer, pictures):
    from playwright.sync_api import sync_playwright

    linear = Path("linear-n8.recipe")
    run(trainer, "train", "--model", "linear", "--samples", 8, "--effort", "brief", "--data", "procedural:40:1", "--out", linear)
    recipes = [linear, RECIPES / "phong-n8.recipe", RECIPES / "completed/cook-torrance-n8.recipe",
               RECIPES / "neural-n8.recipe", RECIPES / "masked/neural-n16.recipe"]
    run(trainer, "render", "view", *recipes, "--material", MATERIAL, "--out", "view.html")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox", "--disable-gpu"])
        looks = {
            "light": dict(viewport={"width": 1280, "height": 1000}, color_scheme="light"),
            "dark": dict(viewport={"width": 1280, "height": 1000}, color_scheme="dark"),
            "phone": dict(viewport={"width": 390, "height": 844}, device_scale_factor=2, is_mobile=True, has_touch=True),
            "small phone": dict(viewport={"width": 320, "height": 640}, is_mobile=True, has_touch=True),
        }
        backgrounds = set()
        for look, options in looks.items():
            context = browser.new_context(offline=True, **options)
            page = context.new_page()
            complaints = []
            page.on("console", lambda message: complaints.append(message.text))
            page.on("pageerror", lambda error: complaints.append(str(error)))
            page.goto(Path("view.html").resolve().as_uri())
            page.wait_for_function("window.glimpse !== undefined")
            settle(page)
            fits_across(page)
            if look == "light":
                look_at_desktop(page, trainer, recipes, masked=4)
            if "phone" in look:
                before = pixels(page)
                page.locator(".ball").first.tap(position={"x": 90, "y": 60})
                assert pixels(page) != before, "a finger does not move the light"
            backgrounds.add(page.evaluate("getComputedStyle(document.body).backgroundColor"))
            if pictures:
                page.screenshot(path=f"{pictures}/{look}.png", full_page=True)
            assert not complaints, complaints
            context.close()
        assert len(backgrounds) == 2, backgrounds
        browser.close()


if __name__ == "__main__":
    if "--inside" not in sys.argv:
        enter_environment()
    words = [word for word in sys.argv[1:] if word != "--inside"]
    trainer = Path(words[0] if words else ROOT / "target/release/trainer").resolve()
    pictures = Path(words[1]).resolve() if len(words) > 1 else None
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        main(trainer, pictures)
    print("the viewer works")
