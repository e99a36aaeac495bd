// Plot of the BRDF in the plane of incidence at the marked point, whose normal is z.
const STEPS = 361; // outgoing angles of a curve
const MAX_DECADES = 6; // of the logarithmic scale
const MAX_LARGE_MARKS = 60; // maximum number of readings with large marks
const MAX_LIT_ANGLE = 1.55; // maximum polar angle of the light in radians, just above the horizon
const luminance = (rgb, i) => 0.2126 * rgb[i] + 0.7152 * rgb[i + 1] + 0.0722 * rgb[i + 2];
const SUPERSCRIPTS = "⁰¹²³⁴⁵⁶⁷⁸⁹";
const powerOfTen = (n) => "10" + (n < 0 ? "⁻" : "") + [...String(Math.abs(n))].map((digit) => SUPERSCRIPTS[digit]).join("");

const thetaOf = (a) => Math.acos(Math.max(-1, Math.min(1, a[2])));
// Returns the camera's polar angle in the plot: negative on the light's side of the normal, positive on the other side.
const cameraAngle = () => {
  const direction = scene.camera[2];
  const isOnLightSide = direction[0] * scene.light[0] + direction[1] * scene.light[1] > 0;
  return isOnLightSide ? -thetaOf(direction) : thetaOf(direction);
};
// Moves light and camera to a reading, {theta_i, theta_o, phi} in degrees.
const showReading = ({ theta_i, theta_o, phi }) => {
  const [i, o, azimuth] = [theta_i, theta_o, phi].map((degrees) => (degrees * Math.PI) / 180);
  scene.light = [-Math.sin(i), 0, Math.cos(i)];
  const z = [-Math.sin(o) * Math.cos(azimuth), -Math.sin(o) * Math.sin(azimuth), Math.cos(o)];
  const x = unit([z[2], 0, -z[0]]);
  scene.camera = [x, [z[1] * x[2], z[2] * x[0] - z[0] * x[2], -z[1] * x[0]], z];
};
// Moves the light to another angle from the marked point's normal, in the same plane.
const setLightAngle = (theta) => {
  let [x, y] = scene.light;
  const length = Math.hypot(x, y);
  [x, y] = length > 1e-3 ? [x / length, y / length] : [-1, 0];
  scene.light = [Math.sin(theta) * x, Math.sin(theta) * y, Math.cos(theta)];
};

// Returns one standard deviation of a luminance, given a fit's band.
const deviation = (band, theta, thetaO, value) => {
  const columns = (2 * band.max) / band.step + 1;
  // Returns the lower of two steps of the grid, and the weight of the upper one.
  const cell = (angle, first) => {
    const position = (Math.max(first, Math.min(band.max, (angle * 180) / Math.PI)) - first) / band.step;
    const step = Math.min(Math.floor(position), (band.max - first) / band.step - 1);
    return [step, position - step];
  };
  const [[row, v], [column, u]] = [cell(theta, 0), cell(thetaO, -band.max)];
  const at = (row) => (1 - u) * band.values[row * columns + column] + u * band.values[row * columns + column + 1];
  return ((1 - v) * at(row) + v * at(row + 1)) * (value + band.floor);
};

// Draws the plot. `curves` are {core, color, dash, width}, with a fit's band and readings if there are. `scale` is "log", or "root" for the cube root of the BRDF.
// `next` is the reading to take next, {theta_i, theta_o, phi} in degrees, or null.
const drawLobe = (canvas, curves, scale, next) => {
  const ratio = Math.min(devicePixelRatio, 2), width = canvas.clientWidth, height = canvas.clientHeight;
  if (canvas.width !== Math.round(width * ratio)) [canvas.width, canvas.height] = [width * ratio, height * ratio].map(Math.round);
  const context = canvas.getContext("2d"), style = getComputedStyle(document.body);
  const color = (name) => style.getPropertyValue(name).trim();
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  context.font = "12px system-ui, 'DejaVu Sans', sans-serif";
  context.textAlign = "center";
  context.textBaseline = "middle";
  const radius = Math.min(width / 2 - 26, height - 46), center = [width / 2, height - 24];
  if (radius <= 0) return; // not laid out yet
  const point = (theta, fraction) => [center[0] + radius * fraction * Math.sin(theta), center[1] - radius * fraction * Math.cos(theta)];
  const line = (points, close) => {
    context.beginPath();
    points.forEach(([x, y], i) => (i ? context.lineTo(x, y) : context.moveTo(x, y)));
    if (close) context.closePath();
  };

  const theta = thetaOf(scene.light), isLit = theta < MAX_LIT_ANGLE;
  const luminances = curves.map((curve) => {
    const rgb = isLit ? curve.core.lobe(theta, STEPS) : new Float32Array(3 * STEPS);
    return Float32Array.from({ length: STEPS }, (_, i) => luminance(rgb, 3 * i));
  });
  let [min, max] = [Infinity, 0];
  const readings = curves.map((curve) => (isLit && curve.readings ? curve.readings.near(theta) : []));
  const marks = readings.map((list) => list.map((reading) => reading.luminance));
  for (const values of [...luminances, ...marks]) for (const value of values) {
    if (value > 0) [min, max] = [Math.min(min, value), Math.max(max, value)];
  }
  const high = max > 0 ? Math.ceil(Math.log10(max)) : 0;
  const low = Math.min(high - 2, Math.max(high - MAX_DECADES, Number.isFinite(min) ? Math.floor(Math.log10(min)) : -2));
  const fraction = scale === "log"
    ? (value) => (value > 0 ? Math.max(0, Math.min(1, (Math.log10(value) - low) / (high - low))) : 0)
    : (value) => Math.cbrt(Math.max(0, value) / (max || 1));

  // Rings and rays.
  context.strokeStyle = color("--line");
  context.fillStyle = color("--dim");
  context.lineWidth = 1;
  const rings = scale === "log"
    ? Array.from({ length: high - low }, (_, i) => [(i + 1) / (high - low), powerOfTen(low + i + 1)])
    : [0.001, 0.01, 0.1, 0.3, 1].map((part) => [Math.cbrt(part), (part * max).toPrecision(2).replace(/\.?0+$/, "")]);
  // The outermost label comes first. A label that would overlap the previous one is omitted.
  let rightLimit = Infinity;
  for (const [ring, label] of rings.reverse()) {
    context.beginPath();
    context.arc(...center, radius * ring, Math.PI, 0);
    context.stroke();
    const half = context.measureText(label).width / 2 + 3, x = center[0] + radius * ring;
    if (x + half > rightLimit) continue;
    context.fillText(label, x, center[1] + 13);
    rightLimit = x - half;
  }
  for (let degrees = -90; degrees <= 90; degrees += 30) {
    const angle = (degrees * Math.PI) / 180;
    line([center, point(angle, 1)]);
    context.stroke();
    if (Math.abs(degrees) < 90) context.fillText(`${degrees < 0 ? "−" : ""}${Math.abs(degrees)}°`, ...point(angle, 1 + 13 / radius));
  }

  // The reference is drawn first, below the others.
  luminances.forEach((values, index) => {
    const { color: stroke, dash, width: thick, band } = curves[index];
    if (!isLit) return;
    const angle = (i) => (((2 * i + 1) / STEPS - 1) * Math.PI) / 2;
    context.strokeStyle = context.fillStyle = color(stroke);
    if (band) {
      const side = (sign) => Array.from(values, (value, i) => point(angle(i), fraction(value + sign * deviation(band, theta, angle(i), value))));
      line([...side(1), ...side(-1).reverse()], true);
      context.globalAlpha = 0.18;
      context.fill();
      context.globalAlpha = 1;
    }
    context.lineWidth = thick;
    context.lineJoin = "round";
    context.setLineDash(dash);
    line(Array.from(values, (value, i) => point(angle(i), fraction(value))));
    context.stroke();
    context.setLineDash([]);
    context.lineWidth = 1.5;
    for (const reading of readings[index]) {
      context.beginPath();
      context.arc(...point(reading.angle, fraction(reading.luminance)), readings[index].length > MAX_LARGE_MARKS ? 1 : 3, 0, 2 * Math.PI);
      if (reading.isUsed) context.fill();
      context.stroke();
    }
  });

  const mark = (angle, filled) => {
    line([point(angle, 1 - 14 / radius), point(angle + 7 / radius, 1), point(angle - 7 / radius, 1)], true);
    context.fillStyle = context.strokeStyle = color("--text");
    context.lineWidth = 1.5;
    if (filled) context.fill();
    else context.stroke();
  };
  if (next) {
    const isOnLightSide = Math.cos((next.phi * Math.PI) / 180) > 0;
    for (const degrees of [-next.theta_i, isOnLightSide ? -next.theta_o : next.theta_o]) {
      const angle = (degrees * Math.PI) / 180, [near, far, side] = [1 - 11 / radius, 1, 5.5 / radius];
      const middle = (near + far) / 2;
      line([point(angle, near), point(angle + side, middle), point(angle, far), point(angle - side, middle)], true);
      context.fillStyle = color("--best");
      context.fill();
    }
  }
  if (isLit) mark(-theta, true);
  if (Math.abs(cameraAngle()) <= Math.PI / 2) mark(cameraAngle(), false);
  if (!isLit) {
    context.fillStyle = color("--dim");
    context.fillText("The light is below the horizon of the marked point.", center[0], center[1] - radius / 2);
  }
};
