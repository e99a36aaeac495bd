// Readings of a recipe, as sliders: each is multiplied by a power of two.
const STOPS = 5; // as far as a slider goes
const NOTHING = 1e-4; // sr^-1: what a slider multiplies where nothing was read
const digits = (value) => (Math.abs(value) < 0.001 ? value.toExponential(1) : value.toPrecision(3).slice(0, 6));

class Readings {
  // `samples` as the trainer read them: {theta_i, theta_o, phi, brdf or null}.
  constructor(samples, takesMissing) {
    this.samples = samples;
    this.takesMissing = takesMissing;
    this.reset();
  }
  reset() {
    this.stops = this.samples.map(() => 0);
    this.isThere = this.samples.map((sample) => sample.brdf !== null);
  }
  // What a slider at its middle stands for; where nothing was read, what was fitted there.
  base(index) {
    return this.samples[index].brdf || this.fitted[index];
  }
  value(index) {
    if (this.stops[index] === 0) return this.base(index);
    return this.base(index).map((value) => Math.max(value, NOTHING) * 2 ** this.stops[index]);
  }
  all() {
    return this.samples.map((_, index) => (this.isThere[index] ? this.value(index) : null));
  }
  toCsv() {
    const rows = this.all().map((brdf, index) => [index, ...(brdf ? Array.from(brdf, Math.fround) : ["", "", ""]), "brdf"].join(","));
    return ["index,r,g,b,quantity", ...rows, ""].join("\n");
  }

  // Builds the sliders; `changed` is called when one was moved.
  build(list, changed) {
    this.rows = this.samples.map((sample, index) => {
      const row = document.createElement("li");
      const part = (tag, name, text) => {
        const element = document.createElement(tag);
        if (name) element.className = name;
        if (text) element.textContent = text;
        row.append(element);
        return element;
      };
      const degrees = (angle) => `${Math.round(angle)}°`;
      const turn = ((sample.phi + 180) % 360 + 360) % 360 - 180;
      const swatch = part("b");
      part("span", "where", `${index}: θi ${degrees(sample.theta_i)} θo ${degrees(sample.theta_o)} φ ${degrees(turn).replace("-", "−")}`);
      const what = part("span", "what");
      const slider = part("input");
      Object.assign(slider, { type: "range", min: -STOPS, max: STOPS, step: 0.01, value: this.stops[index] });
      slider.setAttribute("aria-label", `Reading ${index}`);
      slider.addEventListener("input", () => {
        this.stops[index] = Number(slider.value);
        changed();
      });
      const switches = part("span", "switches"), reset = document.createElement("button");
      reset.textContent = "↺";
      Object.assign(reset, { type: "button", title: "As it was read" });
      reset.setAttribute("aria-label", `Reading ${index} as it was read`);
      reset.addEventListener("click", () => {
        this.stops[index] = 0;
        this.isThere[index] = sample.brdf !== null;
        changed();
      });
      let box = null;
      if (this.takesMissing) {
        const label = document.createElement("label");
        box = document.createElement("input");
        box.type = "checkbox";
        box.setAttribute("aria-label", `Reading ${index} is there`);
        label.append(box, "read");
        switches.append(label);
        box.addEventListener("change", () => {
          this.isThere[index] = box.checked;
          changed();
        });
      }
      switches.append(reset);
      return { row, swatch, what, slider, box };
    });
    list.replaceChildren(...this.rows.map(({ row }) => row));
    this.tell();
  }
  // What each slider stands for now.
  tell() {
    this.rows.forEach(({ row, swatch, what, slider, box }, index) => {
      const brdf = this.value(index), isThere = this.isThere[index];
      const text = Array.from(brdf, digits).join("  ");
      what.textContent = isThere ? text : "missing";
      slider.value = this.stops[index];
      slider.disabled = !isThere;
      slider.setAttribute("aria-valuetext", `${text} per steradian`);
      if (box) box.checked = isThere;
      row.classList.toggle("missing", !isThere);
      row.classList.toggle("moved", isThere && this.stops[index] !== 0);
      const most = Math.max(...brdf, 1e-6), bright = Math.min(1, Math.cbrt(most * Math.PI));
      swatch.style.background = isThere ? `rgb(${Array.from(brdf, (f) => Math.round(255 * bright * (Math.max(0, f) / most) ** (1 / 2.2))).join(" ")})` : "none";
    });
  }
}
