"use strict";
// The interface to core, with one WebAssembly instance per material. See trainer/viewer/wasm/src/lib.rs.
const BUFFER = { recipe: 0, basis: 1, table: 2, referenceValues: 3, numbers: 4 };
const bytesOf = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));

const MAX_VALUES = 1 << 13; // maximum number of fitted values

class Core {
  constructor(module) {
    this.exports = new WebAssembly.Instance(module).exports;
  }
  // Allocates a buffer and returns the memory and the address. The next call of core may move it.
  allocate(slot, bytes) {
    const address = this.exports.allocate(slot, bytes);
    if (address === 0) throw new Error("the browser is out of memory: close other pages and reload");
    return [this.exports.memory.buffer, address];
  }
  put(slot, bytes) {
    new Uint8Array(...this.allocate(slot, bytes.length), bytes.length).set(bytes);
  }
  // Returns a view of the buffer of numbers, resized to `count`.
  numbers(count) {
    return new Float32Array(...this.allocate(BUFFER.numbers, 4 * count), count);
  }
  // Throws core's error message if a call failed.
  check(status) {
    if (status === 0) return;
    const { memory, message_address, message_bytes } = this.exports;
    throw new Error(new TextDecoder().decode(new Uint8Array(memory.buffer, message_address(), message_bytes())));
  }
  loadRecipe(recipe, basis) {
    this.put(BUFFER.recipe, recipe);
    if (basis) this.put(BUFFER.basis, basis);
    this.check(this.exports.load_recipe());
  }
  loadTable(table) {
    this.put(BUFFER.table, table);
    this.check(this.exports.load_table());
  }
  loadReferenceValues(values) {
    this.put(BUFFER.referenceValues, values);
  }
  // Fits readings [red, green, blue]; null is a missing one.
  fit(readings) {
    const numbers = this.numbers(4 * readings.length);
    readings.forEach((brdf, index) => numbers.set(brdf ? [...brdf, 1] : [0, 0, 0, 0], 4 * index));
    this.check(this.exports.fit());
  }
  // Returns the result of a call: up to `max` entries of `width` numbers each.
  read(max, width, call) {
    this.numbers(max * width);
    const count = call();
    return this.numbers(max * width).slice(0, count * width);
  }
  values() { return this.read(MAX_VALUES, 1, () => this.exports.values()); }
  brdfAtSamples(samples) { return this.read(samples, 3, () => this.exports.brdf_at_samples()); }
  lobe(theta, steps) { return this.read(steps, 3, () => this.exports.lobe(theta, steps)); }
  loss() { return this.exports.loss(); }
  predictedLoss() { return this.exports.predicted_loss(); }
  lossBound() { return this.exports.loss_bound(); }
  isUnlikeTraining() { return this.exports.is_unlike_training() === 1; }
  residual() { return this.exports.residual(); }
  // Returns rows of a sphere's picture, as a view that is valid until the next call.
  shade(size, first, end, light) {
    this.numbers(3 * size * (end - first));
    this.exports.shade(size, first, end, ...light);
    return this.numbers(3 * size * (end - first));
  }
}
