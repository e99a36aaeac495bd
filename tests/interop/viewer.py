"""Tests pages of `trainer render view` in headless Chromium, without a GPU.

    python3 tests/interop/viewer.py [TRAINER] [PICTURES]

Playwright is installed from PyPI into an environment in target/; Chromium is the system's. The script opens a page
with a recipe of every model from its file, and one with fits of the trainer. It moves light and camera with mouse, touch and keys, moves sliders, and
disables readings. It compares every fit with that of `trainer fit` for the same readings. PICTURES is a folder for
screenshots.
"""
import json, math, os, shutil, subprocess, sys, tempfile, time, venv
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
ENVIRONMENT = ROOT / "target" / "viewer"
RECIPES = ROOT / "trainer" / "recipes"
MATERIAL = "procedural:1:77"
ANY_RECIPES = ["linear-any", "neural-any"]
# Largest allowed error of fitted values, relative to the largest value.
TOLERANCE = 1e-5
# Smallest allowed frame rate while dragging, in frames per second.
MIN_FRAME_RATE = 10


def enter_environment():
    """Restarts this script in the environment, which is created if it does not exist."""
    python = ENVIRONMENT / "bin" / "python"
    if not python.exists():
        venv.create(ENVIRONMENT, with_pip=True)
    subprocess.run([python, "-m", "pip", "install", "--quiet", "playwright"], check=True)
    os.execv(python, [str(python), __file__, *sys.argv[1:], "--inside"])


def run(*command):
    print("==", *command, flush=True)
    subprocess.run([str(word) for word in command], check=True, stdout=subprocess.DEVNULL)


def compare_fits(page, trainer, recipes, step):
    """Compares the fits of the page with those of the trainer, for the page's readings."""
    max_error = 0
    for index, recipe in enumerate(recipes):
        Path("readings.csv").write_text(page.evaluate(f"glimpse.methods[{index}].csv()"))
        out = Path(f"{step}-{index}")
        run(trainer, "fit", recipe, "--measurements", "readings.csv", "--keep-all", "--out", out)
        material = json.loads((out / "material.json").read_text())
        actual, expected = page.evaluate(f"glimpse.methods[{index}].values()"), material["values"]
        assert len(actual) == len(expected) > 0, (recipe, len(actual), len(expected))
        largest = max(map(abs, expected))
        error = max(abs(a - b) for a, b in zip(actual, expected)) / largest
        max_error = max(max_error, error)
        assert error <= TOLERANCE, (recipe, step, error)
    print(f"{step}: the largest relative error of values is {max_error:.1e}")


def settle(page):
    page.wait_for_function("glimpse.isResting()")
    page.wait_for_timeout(50)


def pixels(page):
    """Returns the pictures of all spheres."""
    settle(page)
    return page.evaluate("[...document.querySelectorAll('.sphere canvas')].map((canvas) => canvas.toDataURL())")


def check_width(page):
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth"), "the page is wider than the window"


def drag(page, seconds=3):
    """Drags the light in circles and returns the frame rate."""
    box = page.locator(".sphere").first.bounding_box()
    x, y, radius = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2, box["width"] / 4
    page.mouse.move(x, y)
    page.mouse.down()
    before, start, step = page.evaluate("glimpse.frames()"), time.monotonic(), 0
    while time.monotonic() - start < seconds:
        page.mouse.move(x + radius * math.cos(step / 9), y + radius * math.sin(step / 9))
        step += 1
    # The frames are read before the time, so late frames do not count.
    frames = page.evaluate("glimpse.frames()") - before
    seconds = time.monotonic() - start
    page.mouse.up()
    return frames / seconds


def check_desktop(page, trainer, recipes, masked):
    compare_fits(page, trainer, recipes, "as-read")
    before = pixels(page)
    frame_rate = drag(page)
    print(f"{frame_rate:.1f} frames per second while the light of {len(recipes) + 1} spheres is dragged")
    assert frame_rate >= MIN_FRAME_RATE, frame_rate
    after = pixels(page)
    assert all(a != b for a, b in zip(before, after)), "the light moved, but a sphere did not change"

    # Move the camera with the right button, and reset it with a key.
    sphere = page.locator(".sphere").first
    box = sphere.bounding_box()
    page.mouse.move(box["x"] + 80, box["y"] + 80)
    page.mouse.down(button="right")
    page.mouse.move(box["x"] + 130, box["y"] + 90, steps=4)
    page.mouse.up(button="right")
    ring = "document.querySelector('.sphere i').style.left"
    settle(page)
    assert page.evaluate(ring) != "50%", "the camera did not move"
    sphere.focus()
    page.keyboard.press("Home")
    settle(page)
    assert page.evaluate(ring) == "50%"
    assert pixels(page) == before, "Home does not reset the camera and the light"
    page.keyboard.press("ArrowLeft")
    assert pixels(page) != before, "keys do not move the light"
    page.keyboard.press("Home")

    # The sliders of a method change only its own sphere.
    buttons = page.locator(".select-readings")
    for index in range(len(recipes)):
        before = pixels(page)
        losses = page.evaluate("glimpse.methods.map((method) => method.loss())")
        buttons.nth(index).click()
        slider = page.locator("#readings input[type=range]").nth(1)
        slider.focus()
        for _ in range(25):
            page.keyboard.press("ArrowRight")
        changed = [a != b for a, b in zip(before, pixels(page))]
        assert changed == [sphere == index + 1 for sphere in range(len(recipes) + 1)], changed
        assert page.evaluate("glimpse.methods.map((method) => method.loss())")[index] != losses[index]
    compare_fits(page, trainer, recipes, "moved")
    buttons.nth(masked).click()
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
    assert page.locator("#refused").is_visible(), "a fit without readings is not refused"
    page.locator("#reset").click()
    settle(page)
    assert page.locator("#refused").is_hidden()


def check_fits_of_trainer(page, trainer):
    """Compares the losses of a page with fits of readings at any directions with those of the trainer."""
    assert page.locator("#change").is_hidden() and page.locator("#readings input:visible").count() == 0
    assert page.locator("#theta-value").text_content() == "20°", "the light is not that of the readings"
    for index, recipe in enumerate(ANY_RECIPES):
        run(trainer, "fit", recipe, "--measurements", "line.csv", "--out", recipe)
        compared = subprocess.run([trainer, "compare", MATERIAL, f"{recipe}/material.json", "--json"], check=True, stdout=subprocess.PIPE)
        expected = json.loads(compared.stdout)["materials"][0]["loss"]
        loss = page.evaluate(f"glimpse.methods[{index}].loss()")
        assert abs(loss - expected) < 0.003, (recipe, loss, expected)


def main(trainer, pictures):
    from playwright.sync_api import sync_playwright

    linear = Path("linear-n8.recipe")
    run(trainer, "train", "--model", "linear", "--samples", 8, "--effort", "brief", "--data", "procedural:40:1", "--out", linear)
    recipes = [linear, RECIPES / "paper/phong-n8.recipe", RECIPES / "completed/cook-torrance-n8.recipe",
               RECIPES / "paper/neural-n8.recipe", RECIPES / "masked/neural-n16.recipe"]
    run(trainer, "render", "view", *recipes, "--material", MATERIAL, "--out", "view.html", "--force")
    Path("angles.csv").write_text("".join(["theta_i,theta_o\n", *(f"20,{theta_o}\n" for theta_o in range(-60, 80, 10))]))
    run(trainer, "query", MATERIAL, "--angles", "angles.csv", "--out", "line.csv")
    run(trainer, "render", "view", *ANY_RECIPES, "--measurements", "line.csv", "line.csv", "--reference", MATERIAL, "--out", "any.html")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox", "--disable-gpu"])
        devices = {
            "light": dict(viewport={"width": 1280, "height": 1000}, color_scheme="light"),
            "dark": dict(viewport={"width": 1280, "height": 1000}, color_scheme="dark"),
            "phone": dict(viewport={"width": 390, "height": 844}, device_scale_factor=2, is_mobile=True, has_touch=True),
            "small phone": dict(viewport={"width": 320, "height": 640}, is_mobile=True, has_touch=True),
        }
        backgrounds = set()
        for device, options in devices.items():
            context = browser.new_context(offline=True, **options)
            page = context.new_page()
            errors = []
            page.on("console", lambda message: errors.append(message.text))
            page.on("pageerror", lambda error: errors.append(str(error)))
            page.goto(Path("view.html").resolve().as_uri())
            page.wait_for_function("window.glimpse !== undefined")
            settle(page)
            check_width(page)
            if device == "light":
                check_desktop(page, trainer, recipes, masked=4)
                page.goto(Path("any.html").resolve().as_uri())
                page.wait_for_function("window.glimpse !== undefined")
                settle(page)
                check_fits_of_trainer(page, trainer)
                check_width(page)
            if "phone" in device:
                before = pixels(page)
                page.locator(".sphere").first.tap(position={"x": 90, "y": 60})
                assert pixels(page) != before, "a touch does not move the light"
            backgrounds.add(page.evaluate("getComputedStyle(document.body).backgroundColor"))
            if pictures:
                page.screenshot(path=f"{pictures}/{device}.png", full_page=True)
            assert not errors, errors
            context.close()
        assert len(backgrounds) == 2, backgrounds
        browser.close()


if __name__ == "__main__":
    if "--inside" not in sys.argv:
        enter_environment()
    arguments = [argument for argument in sys.argv[1:] if argument != "--inside"]
    trainer = Path(arguments[0] if arguments else ROOT / "target/release/trainer").resolve()
    pictures = Path(arguments[1]).resolve() if len(arguments) > 1 else None
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        main(trainer, pictures)
    print("the viewer works")
