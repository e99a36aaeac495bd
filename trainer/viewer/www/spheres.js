// Spheres of all materials, and the motion of light and camera.
const MAX_SIZE = 384; // maximum side of a picture in pixels
const MIN_SIZE = 64; // minimum side of a picture in pixels
const FRAME_BUDGET = 30; // milliseconds of shading per frame during motion
const DEFAULT_VIEW = { light: [-0.42, 0.5, 0.757], camera: [[1, 0, 0], [0, 1, 0], [0, 0, 1]] };

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const scaled = (a, s) => a.map((x) => x * s);
const unit = (a) => scaled(a, 1 / Math.hypot(...a));
const rotated = (a, axis, angle) => {
  const [c, s, d] = [Math.cos(angle), Math.sin(angle), dot(a, axis) * (1 - Math.cos(angle))];
  const [x, y, z] = axis;
  const cross = [y * a[2] - z * a[1], z * a[0] - x * a[2], x * a[1] - y * a[0]];
  return a.map((value, i) => value * c + cross[i] * s + axis[i] * d);
};

// The direction to the light, the camera's axes, and the exposure in stops. The axes point right, up, and from the
// sphere to the camera. The frame's z axis is the normal at the sphere's marked point.
const scene = { light: unit(DEFAULT_VIEW.light), camera: DEFAULT_VIEW.camera, stops: 0 };
const toCamera = (a) => scene.camera.map((axis) => dot(axis, a));
const fromCamera = (a) => [0, 1, 2].map((i) => scene.camera[0][i] * a[0] + scene.camera[1][i] * a[1] + scene.camera[2][i] * a[2]);
const moveLight = (right, up) => {
  scene.light = unit(rotated(rotated(scene.light, scene.camera[1], right), scene.camera[0], -up));
};
const moveCamera = (right, up) => {
  const [x, y] = scene.camera;
  scene.camera = scene.camera.map((axis) => unit(rotated(rotated(axis, y, -right), x, up)));
};

// The tone mapping table, indexed by the upper 16 bits of a nonnegative float. A value x is exposed, compressed by
// 1 - exp(-1.7 x) and encoded as sRGB, as in the trainer's pictures.
const TONE_MAP = new Uint8ClampedArray(1 << 15);
const expose = (stops) => {
  const bits = new Uint32Array(1), value = new Float32Array(bits.buffer);
  for (let i = 0; i < TONE_MAP.length; i++) {
    bits[0] = (i << 16) | 0x8000;
    const x = -Math.expm1(-1.7 * 2 ** stops * value[0]);
    TONE_MAP[i] = Number.isNaN(x) ? 0 : 255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055);
  }
};

class Sphere {
  constructor(core, canvas) {
    this.core = core;
    this.canvas = canvas;
    this.cost = 1e-3; // milliseconds per pixel
  }
  maxSize() {
    const side = Math.round(this.canvas.clientWidth * Math.min(devicePixelRatio, 2));
    return Math.max(MIN_SIZE, Math.min(MAX_SIZE, side));
  }
  // Shades rows `first` to `end` (exclusive) into an image.
  shadeRows(image, first, end) {
    const size = image.width, start = performance.now();
    const radiance = this.core.shade(size, first, end, unit(toCamera(scene.light)));
    const bits = new Uint32Array(radiance.buffer, radiance.byteOffset, radiance.length);
    for (let from = 0, to = 4 * size * first; from < bits.length; from += 3, to += 4) {
      for (let i = 0; i < 3; i++) image.data[to + i] = TONE_MAP[(bits[from + i] >> 16) & 0x7fff];
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
  // Draws the whole picture at once, `size` pixels along a side.
  draw(size) {
    const image = new ImageData(size, size);
    this.shadeRows(image, 0, size);
    this.show(image);
    this.refined = size >= this.maxSize();
    this.image = null;
  }
  // Shades more rows of the picture in full size until `deadline`, a time of performance.now(). Returns true once the
  // picture is complete.
  refine(deadline) {
    if (this.refined) return true;
    const size = this.maxSize();
    if (!this.image || this.image.width !== size) [this.image, this.row] = [new ImageData(size, size), 0];
    while (this.row < size) {
      if (performance.now() > deadline) return false;
      const end = Math.min(size, this.row + 16);
      this.shadeRows(this.image, this.row, end);
      this.row = end;
    }
    this.show(this.image);
    this.refined = true;
    this.image = null;
    return true;
  }
}

// Returns the side in pixels at which shading all spheres takes the frame budget.
const movingSize = (spheres) => {
  const cost = spheres.reduce((sum, sphere) => sum + sphere.cost, 0);
  const size = 16 * Math.floor(Math.sqrt(FRAME_BUDGET / cost) / 16);
  return Math.max(MIN_SIZE, Math.min(MAX_SIZE, size));
};

// Returns an exposure, in stops, that suits a material's brightness.
const automaticStops = (core) => {
  const values = Array.from(core.shade(48, 0, 48, unit(toCamera(scene.light)))).filter((x) => x > 0);
  const bright = values.sort((a, b) => a - b)[Math.floor(0.97 * values.length)] || 1;
  return Math.max(-4, Math.min(6, Math.round(10 * Math.log2(0.9 / bright)) / 10));
};

// Handles touch, mouse and keys on a sphere's element. `mode` returns "camera" if dragging moves the camera. A change
// calls `onChange`.
const addControls = (element, mode, onChange) => {
  const pointers = new Map();
  const moveHighlight = (event) => {
    const box = element.getBoundingClientRect();
    let [x, y] = [(2 * (event.clientX - box.left)) / box.width - 1, 1 - (2 * (event.clientY - box.top)) / box.height];
    const distance = Math.hypot(x, y);
    if (distance > 0.97) [x, y] = [(0.97 * x) / distance, (0.97 * y) / distance];
    // A mirror would reflect the light to the camera at this point.
    const z = Math.sqrt(1 - x * x - y * y);
    scene.light = unit(fromCamera([2 * z * x, 2 * z * y, 2 * z * z - 1]));
  };
  const dragCamera = (dx, dy) => moveCamera((2.4 * dx) / element.clientWidth, (2.4 * dy) / element.clientWidth);
  const movesCamera = (event) => mode() === "camera" || event.buttons === 2 || pointers.size > 1;
  element.addEventListener("contextmenu", (event) => event.preventDefault());
  element.addEventListener("pointerdown", (event) => {
    element.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, [event.clientX, event.clientY]);
    if (!movesCamera(event)) moveHighlight(event);
    onChange();
  });
  element.addEventListener("pointermove", (event) => {
    const before = pointers.get(event.pointerId);
    if (!before) return;
    if (movesCamera(event)) dragCamera((event.clientX - before[0]) / pointers.size, (event.clientY - before[1]) / pointers.size);
    else moveHighlight(event);
    pointers.set(event.pointerId, [event.clientX, event.clientY]);
    onChange();
  });
  for (const end of ["pointerup", "pointercancel"]) {
    element.addEventListener(end, (event) => pointers.delete(event.pointerId));
  }
  const KEYS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
  element.addEventListener("keydown", (event) => {
    if (event.key === "Home") resetView();
    else if (!KEYS[event.key] || event.ctrlKey || event.altKey || event.metaKey) return;
    else {
      const [right, up] = scaled(KEYS[event.key], Math.PI / 60);
      if (event.shiftKey || mode() === "camera") moveCamera(right, -up);
      else moveLight(right, up);
    }
    event.preventDefault();
    onChange();
  });
};

const resetView = () => [scene.light, scene.camera] = [unit(DEFAULT_VIEW.light), DEFAULT_VIEW.camera];
