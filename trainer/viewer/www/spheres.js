// Spheres: what is seen of each material, and how light and camera move.
const FULL = 384; // the most pixels along a side, at rest
const LEAST = 64; // while something moves
const BUDGET = 30; // milliseconds of shading in a frame that shall be smooth
const HOME = { light: [-0.42, 0.5, 0.757], camera: [[1, 0, 0], [0, 1, 0], [0, 0, 1]] };

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const scaled = (a, s) => a.map((x) => x * s);
const unit = (a) => scaled(a, 1 / Math.hypot(...a));
const turned = (a, axis, angle) => {
  const [c, s, d] = [Math.cos(angle), Math.sin(angle), dot(a, axis) * (1 - Math.cos(angle))];
  const [x, y, z] = axis;
  const across = [y * a[2] - z * a[1], z * a[0] - x * a[2], x * a[1] - y * a[0]];
  return a.map((value, i) => value * c + across[i] * s + axis[i] * d);
};

// The light, and the camera's right, up and towards, all as seen from the material; the marked point's
// normal is z.
const scene = { light: unit(HOME.light), camera: HOME.camera, stops: 0 };
const toCamera = (a) => scene.camera.map((axis) => dot(axis, a));
const fromCamera = (a) => [0, 1, 2].map((i) => scene.camera[0][i] * a[0] + scene.camera[1][i] * a[1] + scene.camera[2][i] * a[2]);
const moveLight = (right, up) => {
  scene.light = unit(turned(turned(scene.light, scene.camera[1], right), scene.camera[0], -up));
};
const moveCamera = (right, up) => {
  const [x, y] = scene.camera;
  scene.camera = scene.camera.map((axis) => unit(turned(turned(axis, y, -right), x, up)));
};

// From radiance to what is shown: exposed, compressed like film, encoded as sRGB, as in the trainer's
// pictures. Looked up by the upper half of a float's bits.
const SHOWN = new Uint8ClampedArray(1 << 15);
const expose = (stops) => {
  const bits = new Uint32Array(1), value = new Float32Array(bits.buffer);
  for (let i = 0; i < SHOWN.length; i++) {
    bits[0] = (i << 16) | 0x8000;
    const x = -Math.expm1(-1.7 * 2 ** stops * value[0]);
    SHOWN[i] = Number.isNaN(x) ? 0 : 255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055);
  }
};

class Sphere {
  constructor(core, canvas) {
    this.core = core;
    this.canvas = canvas;
    this.cost = 1e-3; // milliseconds a pixel
  }
  full() {
    const side = Math.round(this.canvas.clientWidth * Math.min(devicePixelRatio, 2));
    return Math.max(LEAST, Math.min(FULL, side));
  }
  // Shades rows into an image.
  rows(image, first, end) {
    const size = image.width, start = performance.now();
    const radiance = this.core.shade(size, first, end, unit(toCamera(scene.light)));
    const bits = new Uint32Array(radiance.buffer, radiance.byteOffset, radiance.length);
    for (let from = 0, to = 4 * size * first; from < bits.length; from += 3, to += 4) {
      for (let i = 0; i < 3; i++) image.data[to + i] = SHOWN[(bits[from + i] >> 16) & 0x7fff];
      image.data[to + 3] = 255;
    }
    this.cost += 0.3 * ((performance.now() - start) / (size * (end - first)) - this.cost);
  }
  show(image) {
    if (this.canvas.width !== image.width) this.canvas.width = this.canvas.height = image.width;
    this.canvas.getContext("2d").putImageData(image, 0, 0);
    this.canvas.dataset.size = image.width;
    this.canvas.dataset.drawn = 1 + Number(this.canvas.dataset.drawn || 0);
  }
  // All of it at once, in so many pixels.
  draw(size) {
    const image = new ImageData(size, size);
    this.rows(image, 0, size);
    this.show(image);
    this.refined = size >= this.full();
    this.image = null;
  }
  // A few more rows of the picture at its full size; true once it is there.
  refine(until) {
    if (this.refined) return true;
    const size = this.full();
    if (!this.image || this.image.width !== size) [this.image, this.row] = [new ImageData(size, size), 0];
    while (this.row < size) {
      if (performance.now() > until) return false;
      const end = Math.min(size, this.row + 16);
      this.rows(this.image, this.row, end);
      this.row = end;
    }
    this.show(this.image);
    this.refined = true;
    this.image = null;
    return true;
  }
}

// Pixels along a side by which all spheres take no longer than the budget.
const movingSize = (spheres) => {
  const cost = spheres.reduce((sum, sphere) => sum + sphere.cost, 0);
  const size = 16 * Math.floor(Math.sqrt(BUDGET / cost) / 16);
  return Math.max(LEAST, Math.min(FULL, size));
};

// The stops by which a material is neither dark nor glaring.
const fittingStops = (core) => {
  const seen = Array.from(core.shade(48, 0, 48, unit(toCamera(scene.light)))).filter((x) => x > 0);
  const bright = seen.sort((a, b) => a - b)[Math.floor(0.97 * seen.length)] || 1;
  return Math.max(-4, Math.min(6, Math.round(10 * Math.log2(0.9 / bright)) / 10));
};

// Makes a sphere answer to fingers, mouse and keys.
const listen = (ball, mode, changed) => {
  const fingers = new Map();
  const follow = (event) => {
    const box = ball.getBoundingClientRect();
    let [x, y] = [(2 * (event.clientX - box.left)) / box.width - 1, 1 - (2 * (event.clientY - box.top)) / box.height];
    const distance = Math.hypot(x, y);
    if (distance > 0.97) [x, y] = [(0.97 * x) / distance, (0.97 * y) / distance];
    // The light whose mirror direction at this point is the camera's.
    const z = Math.sqrt(1 - x * x - y * y);
    scene.light = unit(fromCamera([2 * z * x, 2 * z * y, 2 * z * z - 1]));
  };
  const turn = (dx, dy) => moveCamera((2.4 * dx) / ball.clientWidth, (2.4 * dy) / ball.clientWidth);
  const turnsCamera = (event) => mode() === "camera" || event.buttons === 2 || fingers.size > 1;
  ball.addEventListener("contextmenu", (event) => event.preventDefault());
  ball.addEventListener("pointerdown", (event) => {
    ball.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
    if (!turnsCamera(event)) follow(event);
    changed();
  });
  ball.addEventListener("pointermove", (event) => {
    const before = fingers.get(event.pointerId);
    if (!before) return;
    if (turnsCamera(event)) turn((event.clientX - before[0]) / fingers.size, (event.clientY - before[1]) / fingers.size);
    else follow(event);
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
    changed();
  });
  for (const end of ["pointerup", "pointercancel"]) ball.addEventListener(end, (event) => fingers.delete(event.pointerId));
  const KEYS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
  ball.addEventListener("keydown", (event) => {
    if (event.key === "Home") goHome();
    else if (!KEYS[event.key] || event.ctrlKey || event.altKey || event.metaKey) return;
    else {
      const [right, up] = scaled(KEYS[event.key], Math.PI / 60);
      if (event.shiftKey || mode() === "camera") moveCamera(right, -up);
      else moveLight(right, up);
    }
    event.preventDefault();
    changed();
  });
};

const goHome = () => [scene.light, scene.camera] = [unit(HOME.light), HOME.camera];
