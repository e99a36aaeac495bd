// The page: its elements, and the loop that redraws after changes.
const byId = (id) => document.getElementById(id);
const COLORS = ["--c0", "--c1", "--c2", "--c3", "--c4"];
const REST_DELAY = 150; // milliseconds without a change before pictures are drawn in full size
const REFINE_BUDGET = 12; // milliseconds of shading in full size per frame
const MAX_DRAG_ANGLE = 1.535; // maximum polar angle in radians to which the plot's light can be dragged

const start = async () => {
  const data = JSON.parse(byId("data").textContent);
  const module = await WebAssembly.compile(bytesOf(data.wasm));
  const referenceValues = data.reference && bytesOf(data.reference.judge);
  const materials = [];
  if (data.reference) {
    const core = new Core(module);
    core.loadTable(bytesOf(data.reference.table));
    materials.push({ core, name: "Reference", reference: data.reference, color: "--text", dash: [7, 4], width: 2 });
  }
  data.shown.forEach((scan, index) => {
    const core = new Core(module);
    if (scan.fit) core.loadTable(bytesOf(scan.fit.table));
    else core.loadRecipe(bytesOf(scan.recipe), scan.basis && bytesOf(scan.basis));
    if (referenceValues) core.loadReferenceValues(referenceValues);
    const readings = new Readings(scan.samples, scan.takes_missing, scan.fit !== null);
    const band = scan.fit && { ...scan.fit.band, values: new Float32Array(bytesOf(scan.fit.band.values).buffer) };
    materials.push({ core, name: scan.name, scan, readings, band, color: COLORS[index], dash: [], width: 2.5, error: null });
  });
  const methods = materials.filter((material) => material.scan);
  let selected = methods[0];
  let changedAt = 0, isMoving = false, isResting = true, frames = 0;

  // An invalid fit does not replace the previous one.
  const refit = (method) => {
    const { core, readings, scan } = method;
    if (scan.fit) {
      const { loss, bound } = scan.fit.expected_loss ?? {};
      Object.assign(method, { loss: core.loss(), predicted: loss ?? NaN, bound: bound ?? NaN, residual: scan.fit.residual });
      return;
    }
    try {
      core.fit(readings.values());
      method.error = null;
    } catch (error) {
      method.error = error.message;
      if (!readings.firstFit) throw new Error(`${scan.name}: ${error.message}`);
      return;
    }
    const flat = core.brdfAtSamples(scan.samples.length);
    // The first fit provides the base values of missing readings.
    readings.firstFit ||= scan.samples.map((_, i) => Array.from(flat.slice(3 * i, 3 * i + 3)));
    method.loss = core.loss();
    method.predicted = core.predictedLoss();
    method.bound = core.lossBound();
    method.isUnlike = core.isUnlikeTraining();
    method.residual = core.residual();
  };
  const formatLoss = (loss) => (Number.isNaN(loss) ? null : loss.toFixed(4));
  const updateFacts = (method) => {
    const { loss, predicted, bound, isUnlike, residual, scan, facts } = method;
    const expected = scan.expected_loss === null ? NaN : scan.expected_loss;
    const list = [["Loss", formatLoss(loss)], ["predicted", formatLoss(predicted)], ["at most (90 %)", formatLoss(bound)], ["at readings", formatLoss(residual)], ["trained on", scan.trained_on], ["note", isUnlike ? "readings unlike the training" : null]];
    if (Number.isNaN(predicted)) list[1] = ["expected", formatLoss(expected)];
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
  const updateScene = () => {
    const [x, y, z] = toCamera([0, 0, 1]);
    for (const { ring } of materials) {
      ring.style.left = `${50 * (1 + x)}%`;
      ring.style.top = `${50 * (1 - y)}%`;
      ring.hidden = z < 0;
    }
    const degrees = (thetaOf(scene.light) * 180) / Math.PI;
    byId("theta").value = degrees;
    byId("theta-value").textContent = `${degrees.toFixed(0)}°`;
    drawLobe(byId("lobe"), materials, byId("scale").value, selected.scan.next);
  };
  const frame = () => {
    const spheres = materials.map((material) => material.sphere);
    if (isMoving) {
      isMoving = false;
      for (const method of methods.filter((method) => method.isStale)) {
        method.isStale = false;
        refit(method);
        updateFacts(method);
        method.readings.update();
        byId("refused").hidden = method.error === null;
        byId("refused").textContent = `These readings cannot be fitted: ${method.error}. The page shows the last fit.`;
      }
      const size = movingSize(spheres);
      for (const sphere of spheres) sphere.draw(Math.min(size, sphere.maxSize()));
      updateScene();
      frames += 1;
    } else if (performance.now() - changedAt > REST_DELAY) {
      const deadline = performance.now() + REFINE_BUDGET;
      isResting = spheres.every((sphere) => sphere.refine(deadline));
    }
    if (!isResting) requestAnimationFrame(frame);
  };

  const select = (method) => {
    selected = method;
    for (const other of methods) other.button.setAttribute("aria-pressed", other === method);
    byId("selected").textContent = method.name;
    const missing = method.scan.takes_missing ? " Readings can be missing." : "";
    const { fit, next } = method.scan;
    const use = fit
      ? `The trainer fitted these readings, and the page draws a table of its fit with loss ${fit.table_loss.toFixed(4)}. To change a reading, edit its file and write the page again.`
      : `A slider multiplies or divides it by up to ${2 ** MAX_STOPS}, and the page fits the readings again.${missing}`;
    byId("readings-caption").textContent = `The BRDF in sr⁻¹ (red, green, blue), not times the cosine. ${use}`;
    byId("change").hidden = Boolean(fit);
    byId("refused").hidden = true;
    byId("next").hidden = byId("next-key").hidden = !next;
    if (next) byId("next-angles").textContent = formatAngles(next);
    changed();
    method.readings.build(byId("readings"), () => {
      method.isStale = true;
      changed();
    });
  };

  // Content of the page.
  byId("title").textContent = data.title;
  const inPage = " in this page, by the code that runs on the scanner. Move the light; change a reading.";
  const where = methods.every((method) => method.scan.fit) ? " by the trainer. Move the light." : inPage;
  byId("lead").textContent = (data.reference ? "Scans of this material, fitted" : "Fitted from readings") + where;
  byId("viewer").hidden = false;
  for (const material of materials) {
    const figure = document.createElement("figure");
    figure.innerHTML = '<div class="sphere" tabindex="0" role="application"><canvas></canvas><i></i></div><figcaption><span class="key"></span><b></b><div></div><dl></dl></figcaption>';
    const [element, canvas, key, name, summary] = ["div", "canvas", ".key", "b", "figcaption div"].map((part) => figure.querySelector(part));
    element.setAttribute("aria-label", `Sphere: ${material.name}. Arrow keys move the light, with Shift the camera; Home resets both.`);
    name.textContent = material.name;
    key.style.borderColor = `var(${material.color})`;
    key.classList.toggle("reference", !material.scan);
    const { scan } = material;
    summary.textContent = scan ? `${scan.model}, ${scan.samples.length} readings, ${scan.fit ? "fitted by the trainer" : scan.how}` : material.reference.name;
    material.facts = figure.querySelector("dl");
    material.ring = figure.querySelector("i");
    material.sphere = new Sphere(material.core, canvas);
    if (scan) {
      material.button = document.createElement("button");
      Object.assign(material.button, { type: "button", className: "select-readings", textContent: "Readings" });
      material.button.addEventListener("click", () => select(material));
      figure.querySelector("figcaption").append(material.button);
      refit(material);
      updateFacts(material);
    }
    byId("spheres").append(figure);
    addControls(element, () => document.querySelector('[name="drag"]:checked').value, changed);
  }
  // The light begins where the first fit has readings in the plot.
  const [first] = selected.readings.plane;
  if (selected.scan.fit && first) {
    setLightAngle(first.arms[0]);
    DEFAULT_VIEW.light = scene.light;
  }
  byId("band-key").hidden = !methods.some((method) => method.band);
  byId("reading-key").hidden = !methods.some((method) => method.readings.plane.length);
  select(selected);
  if (data.reference) {
    byId("footnote").textContent = `Losses against the reference material are means of |Δ ln(1 + f cos θi)| over ${referenceValues.length / 24} directions, uniform in (θh, θd, φd). The reference sphere is drawn from a table with loss ${data.reference.table_loss.toFixed(4)}.`;
  }

  // Controls.
  const updateExposure = () => {
    expose(scene.stops);
    byId("exposure").value = scene.stops;
    byId("stops").textContent = `${scene.stops < 0 ? "−" : "+"}${Math.abs(scene.stops).toFixed(1)}`;
  };
  scene.stops = automaticStops(materials[0].core);
  updateExposure();
  byId("exposure").addEventListener("input", (event) => {
    scene.stops = Number(event.target.value);
    updateExposure();
    changed();
  });
  byId("home").addEventListener("click", () => {
    resetView();
    scene.stops = automaticStops(materials[0].core);
    updateExposure();
    changed();
  });
  byId("theta").addEventListener("input", (event) => {
    setLightAngle((Number(event.target.value) * Math.PI) / 180);
    changed();
  });
  byId("scale").addEventListener("change", changed);
  byId("show-next").addEventListener("click", () => {
    showReading(selected.scan.next);
    changed();
  });
  byId("reset").addEventListener("click", () => {
    selected.readings.reset();
    selected.isStale = true;
    changed();
  });
  byId("save").addEventListener("click", () => {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([selected.readings.toCsv()], { type: "text/csv" }));
    link.download = `${selected.name}-readings.csv`;
    link.click();
    URL.revokeObjectURL(link.href);
  });
  const lobe = byId("lobe");
  const dragLight = (event) => {
    const box = lobe.getBoundingClientRect();
    const [x, y] = [event.clientX - box.left - box.width / 2, box.bottom - 24 - event.clientY];
    setLightAngle(Math.min(MAX_DRAG_ANGLE, Math.abs(Math.atan2(x, Math.max(y, 0)))));
    changed();
  };
  lobe.addEventListener("pointerdown", (event) => {
    lobe.setPointerCapture(event.pointerId);
    dragLight(event);
  });
  lobe.addEventListener("pointermove", (event) => event.buttons && dragLight(event));
  new ResizeObserver(changed).observe(lobe);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", changed);
  changed();

  // Access for tests and for the browser's console.
  window.glimpse = {
    methods: methods.map((method) => ({
      name: method.name,
      values: () => Array.from(method.core.values()),
      csv: () => method.readings.toCsv(),
      loss: () => method.loss,
      predictedLoss: () => method.predicted,
      lossBound: () => method.bound,
    })),
    frames: () => frames,
    isResting: () => isResting,
  };
};

start().catch((error) => {
  byId("failure").hidden = false;
  byId("failure").textContent = `The page failed to start: ${error.message}. It needs a browser with WebAssembly.`;
  throw error;
});
