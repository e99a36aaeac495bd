// Sliders for the readings of a recipe; each multiplies a reading by a power of two.
const MAX_STOPS = 5; // range of a slider, as an exponent of 2
const MIN_BRDF = 1e-4; // sr^-1; smaller values are raised to this before a slider multiplies them
const MAX_DISTANCE = 0.035; // largest distance of a plotted reading from the plane of incidence, and of its light, in radians
const formatAngles = ({ theta_i, theta_o, phi }) => {
  const [i, o, azimuth] = [theta_i, theta_o, ((phi + 180) % 360 + 360) % 360 - 180].map((angle) => `${Math.round(angle)}°`.replace("-", "−"));
  return `θi ${i} θo ${o} φ ${azimuth}`;
};
const formatBrdf = (value) => (Math.abs(value) < 0.001 ? value.toExponential(1) : value.toPrecision(3).slice(0, 6));

class Readings {
  // `samples` are {theta_i, theta_o, phi, brdf or null, is_used}, angles in degrees. Those of a fit of the host are fixed.
  constructor(samples, toleratesMissing, isFixed) {
    this.samples = samples;
    this.toleratesMissing = toleratesMissing;
    this.isFixed = isFixed;
    // The readings near the plane of incidence, with the polar angles of light and sensor in radians.
    this.plane = samples.flatMap(({ theta_i, theta_o, phi }, index) => {
      const [light, sensor, azimuth] = [theta_i, theta_o, phi].map((degrees) => (degrees * Math.PI) / 180);
      const distance = Math.sin(Math.min(light, sensor)) * Math.abs(Math.sin(azimuth));
      return distance > MAX_DISTANCE ? [] : [{ index, arms: [light, sensor], side: Math.cos(azimuth) > 0 ? -1 : 1 }];
    });
    this.firstFit = null; // the BRDF at each sample, set by the page after the first fit
    this.reset();
  }
  reset() {
    this.stops = this.samples.map(() => 0);
    this.isPresent = this.samples.map((sample) => sample.is_used);
  }
  // Returns the value of a slider at its middle: the reading, or the first fit's value if the reading is missing.
  base(index) {
    return this.samples[index].brdf || this.firstFit[index];
  }
  value(index) {
    if (this.stops[index] === 0) return this.base(index);
    return this.base(index).map((value) => Math.max(value, MIN_BRDF) * 2 ** this.stops[index]);
  }
  // Returns all readings; null is a missing one.
  values() {
    return this.samples.map((_, index) => (this.isPresent[index] ? this.value(index) : null));
  }
  // Returns the readings that the plot shows for light at `theta` radians, with light and sensor exchanged if that brings
  // the light nearer.
  near(theta) {
    return this.plane.flatMap(({ index, arms, side }) => {
      if (!this.samples[index].brdf && !this.isPresent[index]) return [];
      const [light, sensor] = [...arms].sort((a, b) => Math.abs(a - theta) - Math.abs(b - theta));
      if (Math.abs(light - theta) > MAX_DISTANCE) return [];
      return [{ angle: side * sensor, luminance: luminance(this.value(index), 0), isUsed: this.isPresent[index] }];
    });
  }
  toCsv() {
    const rows = this.values().map((brdf, index) => [index, ...(brdf ? Array.from(brdf, Math.fround) : ["", "", ""]), "brdf"].join(","));
    return ["index,r,g,b,quantity", ...rows, ""].join("\n");
  }

  // Builds the sliders in the element `list`. A change calls `onChange`.
  build(list, onChange) {
    this.rows = this.samples.map((sample, index) => {
      const row = document.createElement("li");
      const append = (tag, className, text) => {
        const element = document.createElement(tag);
        if (className) element.className = className;
        if (text) element.textContent = text;
        row.append(element);
        return element;
      };
      const swatch = append("b");
      append("span", "angles", `${index}: ${formatAngles(sample)}`);
      const valueText = append("span", "value");
      const slider = append("input");
      Object.assign(slider, { type: "range", min: -MAX_STOPS, max: MAX_STOPS, step: 0.01, value: this.stops[index] });
      slider.setAttribute("aria-label", `Reading ${index}`);
      slider.addEventListener("input", () => {
        this.stops[index] = Number(slider.value);
        onChange();
      });
      const switches = append("span", "switches"), reset = document.createElement("button");
      reset.textContent = "↺";
      Object.assign(reset, { type: "button", title: "Reset to the original reading" });
      reset.setAttribute("aria-label", `Reset reading ${index}`);
      reset.addEventListener("click", () => {
        this.stops[index] = 0;
        this.isPresent[index] = sample.is_used;
        onChange();
      });
      let checkbox = null;
      if (this.toleratesMissing) {
        const label = document.createElement("label");
        checkbox = document.createElement("input");
        checkbox.type = "checkbox";
        checkbox.setAttribute("aria-label", `Use reading ${index}`);
        label.append(checkbox, "use");
        switches.append(label);
        checkbox.addEventListener("change", () => {
          this.isPresent[index] = checkbox.checked;
          onChange();
        });
      }
      switches.append(reset);
      return { row, swatch, valueText, slider, checkbox };
    });
    list.classList.toggle("fixed", this.isFixed);
    list.replaceChildren(...this.rows.map(({ row }) => row));
    this.update();
  }
  // Updates the texts and states of all sliders.
  update() {
    this.rows.forEach(({ row, swatch, valueText, slider, checkbox }, index) => {
      const brdf = this.value(index), isPresent = this.isPresent[index];
      const text = Array.from(brdf, formatBrdf).join("  ");
      valueText.textContent = isPresent ? text : this.isFixed ? `${text} (not used)` : "missing";
      slider.value = this.stops[index];
      slider.disabled = !isPresent;
      slider.setAttribute("aria-valuetext", `${text} per steradian`);
      if (checkbox) checkbox.checked = isPresent;
      row.classList.toggle("missing", !isPresent);
      row.classList.toggle("moved", isPresent && this.stops[index] !== 0);
      const max = Math.max(...brdf, 1e-6), brightness = Math.min(1, Math.cbrt(max * Math.PI));
      swatch.style.background = isPresent ? `rgb(${Array.from(brdf, (f) => Math.round(255 * brightness * (Math.max(0, f) / max) ** (1 / 2.2))).join(" ")})` : "none";
    });
  }
}
