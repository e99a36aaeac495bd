// The page: what there is, and a loop that draws what has changed.
const find = (id) => document.getElementById(id);
const COLORS = ["--c0", "--c1", "--c2", "--c3", "--c4"];
const REST = 150; // milliseconds without a change until pictures are drawn in full

const start = async () => {
  const data = JSON.parse(find("data").textContent);
  const module = await WebAssembly.compile(bytesOf(data.wasm));
  const judge = data.reference && bytesOf(data.reference.judge);
  const materials = [];
  if (data.reference) {
    const core = new Core(module);
    core.lookAt(bytesOf(data.reference.table));
    materials.push({ core, name: "Reference", reference: data.reference, color: "--text", dash: [7, 4], width: 2 });
  }
  data.shown.forEach((shown, index) => {
    const core = new Core(module);
    core.scanBy(bytesOf(shown.recipe), shown.basis && bytesOf(shown.basis));
    if (judge) core.judgeBy(judge);
    const readings = new Readings(shown.samples, shown.takes_missing);
    materials.push({ core, name: shown.name, shown, readings, color: COLORS[index], dash: [], width: 2.5, error: null });
  });
  const methods = materials.filter((material) => material.shown);
  let selected = methods[0];
  let changedAt = 0, isMoving = false, isResting = true, frames = 0;

  // Only what is valid replaces what is shown.
  const refit = (method) => {
    const { core, readings, shown } = method;
    try {
      core.fit(readings.all());
      method.error = null;
    } catch (error) {
      method.error = error.message;
      if (!readings.fitted) throw new Error(`${shown.name}: ${error.message}`);
      return;
    }
    const flat = core.atSamples(shown.samples.length);
    // What was fitted first stands in for what was never read.
    readings.fitted ||= shown.samples.map((_, i) => Array.from(flat.slice(3 * i, 3 * i + 3)));
    method.loss = judge ? core.loss() : NaN;
    method.predicted = core.predictedLoss();
    method.residual = core.residual();
  };
  const four = (loss) => (Number.isNaN(loss) ? null : loss.toFixed(4));
  const tellMethod = (method) => {
    const { loss, predicted, residual, shown, facts } = method;
    const expected = shown.expected_loss === null ? NaN : shown.expected_loss;
    const list = [["Loss", four(loss)], ["predicted", four(predicted)], ["at readings", four(residual)], ["trained on", shown.trained_on]];
    if (Number.isNaN(predicted)) list[1] = ["expected", four(expected)];
    facts.replaceChildren(...list.filter(([, text]) => text).flatMap(([name, text]) => {
      const [dt, dd] = [document.createElement("dt"), document.createElement("dd")];
      [dt.textContent, dd.textContent] = [name, text];
      return [dt, dd];
    }));
  };

  const changed = () => {
    changedAt = performance.now();
    isMoving = true;
    if (isResting) {
      isResting = false;
      requestAnimationFrame(frame);
    }
  };
  const showScene = () => {
    const [x, y, z] = toCamera([0, 0, 1]);
    for (const { ring } of materials) {
      ring.style.left = `${50 * (1 + x)}%`;
      ring.style.top = `${50 * (1 - y)}%`;
      ring.hidden = z < 0;
    }
    const degrees = (thetaOf(scene.light) * 180) / Math.PI;
    find("theta").value = degrees;
    find("theta-value").textContent = `${degrees.toFixed(0)}°`;
    drawLobe(find("lobe"), materials, find("scale").value);
  };
  const frame = () => {
    const spheres = materials.map((material) => material.sphere);
    if (isMoving) {
      isMoving = false;
      for (const method of methods.filter((method) => method.isStale)) {
        method.isStale = false;
        refit(method);
        tellMethod(method);
        method.readings.tell();
        find("refused").hidden = method.error === null;
        find("refused").textContent = `No fit of these readings: ${method.error}. What is shown is the last one.`;
      }
      const size = movingSize(spheres);
      for (const sphere of spheres) sphere.draw(Math.min(size, sphere.full()));
      showScene();
      frames += 1;
    } else if (performance.now() - changedAt > REST) {
      const until = performance.now() + 12;
      isResting = spheres.every((sphere) => sphere.refine(until));
    }
    if (!isResting) requestAnimationFrame(frame);
  };

  const select = (method) => {
    selected = method;
    for (const other of methods) other.pick.setAttribute("aria-pressed", other === method);
    find("selected").textContent = method.name;
    const missing = method.shown.takes_missing ? " A reading may be missing." : "";
    find("readings-caption").textContent = `The BRDF in sr⁻¹ (red, green, blue), not times the cosine; a slider multiplies it by up to ${2 ** STOPS}, or divides it.${missing}`;
    find("refused").hidden = true;
    method.readings.build(find("readings"), () => {
      method.isStale = true;
      changed();
    });
  };

  // What there is.
  find("title").textContent = data.title;
  find("lead").textContent = data.reference
    ? "Scans of this material, fitted in this page by the code that runs on the scanner. Move the light; change a reading."
    : "Fitted from readings in this page, by the code that runs on the scanner. Move the light; change a reading.";
  find("viewer").hidden = false;
  for (const material of materials) {
    const figure = document.createElement("figure");
    figure.innerHTML = '<div class="ball" tabindex="0" role="application"><canvas></canvas><i></i></div><figcaption><span class="key"></span><b></b><div></div><dl></dl></figcaption>';
    const [ball, canvas, key, name, how] = ["div", "canvas", ".key", "b", "figcaption div"].map((part) => figure.querySelector(part));
    ball.setAttribute("aria-label", `Sphere: ${material.name}. Arrow keys move the light, with Shift the camera; Home resets both.`);
    name.textContent = material.name;
    key.style.borderColor = `var(${material.color})`;
    key.classList.toggle("reference", !material.shown);
    const { shown } = material;
    how.textContent = shown ? `${shown.model}, ${shown.samples.length} readings, ${shown.how}` : material.reference.name;
    material.facts = figure.querySelector("dl");
    material.ring = figure.querySelector("i");
    material.sphere = new Sphere(material.core, canvas);
    if (shown) {
      material.pick = document.createElement("button");
      Object.assign(material.pick, { type: "button", className: "pick", textContent: "Readings" });
      material.pick.addEventListener("click", () => select(material));
      figure.querySelector("figcaption").append(material.pick);
      refit(material);
      tellMethod(material);
    }
    find("spheres").append(figure);
    listen(ball, () => document.querySelector('[name="drag"]:checked').value, changed);
  }
  select(selected);
  if (data.reference) {
    find("footnote").textContent = `Losses are means of |Δ ln(1 + f cos θi)| over ${judge.length / 24} directions, uniform in (θh, θd, φd), against the material itself. The reference is drawn from a table, whose loss is ${data.reference.table_loss.toFixed(4)}.`;
  }

  // What can be done.
  const showStops = () => {
    expose(scene.stops);
    find("exposure").value = scene.stops;
    find("stops").textContent = `${scene.stops < 0 ? "−" : "+"}${Math.abs(scene.stops).toFixed(1)}`;
  };
  scene.stops = fittingStops(materials[0].core);
  showStops();
  find("exposure").addEventListener("input", (event) => {
    scene.stops = Number(event.target.value);
    showStops();
    changed();
  });
  find("home").addEventListener("click", () => {
    goHome();
    scene.stops = fittingStops(materials[0].core);
    showStops();
    changed();
  });
  find("theta").addEventListener("input", (event) => {
    lightAt((Number(event.target.value) * Math.PI) / 180);
    changed();
  });
  find("scale").addEventListener("change", changed);
  find("reset").addEventListener("click", () => {
    selected.readings.reset();
    selected.isStale = true;
    changed();
  });
  find("save").addEventListener("click", () => {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([selected.readings.toCsv()], { type: "text/csv" }));
    link.download = `${selected.name}-readings.csv`;
    link.click();
    URL.revokeObjectURL(link.href);
  });
  const lobe = find("lobe");
  const aim = (event) => {
    const box = lobe.getBoundingClientRect();
    const [x, y] = [event.clientX - box.left - box.width / 2, box.bottom - 24 - event.clientY];
    lightAt(Math.min(1.535, Math.abs(Math.atan2(x, Math.max(y, 0)))));
    changed();
  };
  lobe.addEventListener("pointerdown", (event) => {
    lobe.setPointerCapture(event.pointerId);
    aim(event);
  });
  lobe.addEventListener("pointermove", (event) => event.buttons && aim(event));
  new ResizeObserver(changed).observe(lobe);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", changed);
  changed();

  // For tests, and for the curious.
  window.glimpse = {
    methods: methods.map((method) => ({
      name: method.name,
      values: () => Array.from(method.core.values()),
      csv: () => method.readings.toCsv(),
      loss: () => method.loss,
      predictedLoss: () => method.predicted,
    })),
    frames: () => frames,
    isResting: () => isResting,
  };
};

start().catch((error) => {
  find("failure").hidden = false;
  find("failure").textContent = `This page cannot compute: ${error.message}. It takes a browser with WebAssembly.`;
  throw error;
});
