"use strict";
// Core, in an instance for each material: numbers in, numbers out. See trainer/viewer/wasm/src/lib.rs.
const ROOM = { recipe: 0, basis: 1, table: 2, judge: 3, numbers: 4 };
const bytesOf = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));

class Core {
  constructor(module) {
    this.core = new WebAssembly.Instance(module).exports;
  }
  // A view of a room; the next call of core may move it.
  room(slot, bytes) {
    const at = this.core.room(slot, bytes);
    if (at === 0) throw new Error("the browser gives no more memory");
    return [this.core.memory.buffer, at];
  }
  put(slot, bytes) {
    new Uint8Array(...this.room(slot, bytes.length), bytes.length).set(bytes);
  }
  numbers(count) {
    return new Float32Array(...this.room(ROOM.numbers, 4 * count), count);
  }
  // Calls what can fail.
  must(outcome) {
    if (outcome === 0) return;
    const { memory, message_at, message_bytes } = this.core;
    throw new Error(new TextDecoder().decode(new Uint8Array(memory.buffer, message_at(), message_bytes())));
  }
  scanBy(recipe, basis) {
    this.put(ROOM.recipe, recipe);
    if (basis) this.put(ROOM.basis, basis);
    this.must(this.core.begin());
  }
  lookAt(table) {
    this.put(ROOM.table, table);
    this.must(this.core.look_at_table());
  }
  judgeBy(judge) {
    this.put(ROOM.judge, judge);
  }
  // Of readings [red, green, blue], or null where one is missing.
  fit(readings) {
    const numbers = this.numbers(4 * readings.length);
    readings.forEach((brdf, index) => numbers.set(brdf ? [...brdf, 1] : [0, 0, 0, 0], 4 * index));
    this.must(this.core.fit());
  }
  // What a function leaves, `width` numbers each.
  left(most, width, call) {
    this.numbers(most * width);
    const count = call();
    return this.numbers(most * width).slice(0, count * width);
  }
  values() { return this.left(1 << 13, 1, () => this.core.values()); }
  atSamples(samples) { return this.left(samples, 3, () => this.core.at_samples()); }
  lobe(theta, steps) { return this.left(steps, 3, () => this.core.lobe(theta, steps)); }
  loss() { return this.core.loss(); }
  predictedLoss() { return this.core.predicted_loss(); }
  residual() { return this.core.residual(); }
  // Rows of a sphere's picture, as a view that lasts until the next call.
  shade(size, first, end, light) {
    this.numbers(3 * size * (end - first));
    this.core.shade(size, first, end, ...light);
    return this.numbers(3 * size * (end - first));
  }
}
