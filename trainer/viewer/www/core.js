"use strict";
// The interface to core, with one WebAssembly instance per material. See trainer/viewer/wasm/src/lib.rs.
const BUFFER = { recipe: 0, basis: 1, table: 2, referenceValues: 3, numbers: 4 };
const bytesOf = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));

class Core {
  constructor(module) {
    this.core = new WebAssembly.Instance(module).exports;
  }
  // Allocates a buffer; the next call of core may move it.
  allocate(slot, bytes) {
    const address = this.core.room(slot, bytes);
    if (address === 0) throw new Error("the browser is out of memory: close other pages and reload");
    return [this.core.memory.buffer, address];
  }
  put(slot, bytes) {
    new Uint8Array(...this.allocate(slot, bytes.length), bytes.length).set(bytes);
  }
  numbers(count) {
    return new Float32Array(...this.allocate(BUFFER.numbers, 4 * count), count);
  }
  // Throws core's error message if a call failed.
  check(status) {
    if (status === 0) return;
    const { memory, message_at, message_bytes } = this.core;
    throw new Error(new TextDecoder().decode(new Uint8Array(memory.buffer, message_at(), message_bytes())));
  }
  loadRecipe(recipe, basis) {
    this.put(BUFFER.recipe, recipe);
    if (basis) this.put(BUFFER.basis, basis);
    this.check(this.core.begin());
  }
  loadTable(table) {
    this.put(BUFFER.table, table);
    this.check(this.core.look_at_table());
  }
  loadReferenceValues(values) {
    this.put(BUFFER.referenceValues, values);
  }
  // Fits readings [red, green, blue]; null is a missing one.
  fit(readings) {
    const numbers = this.numbers(4 * readings.length);
    readings.forEach((brdf, index) => numbers.set(brdf ? [...brdf, 1] : [0, 0, 0, 0], 4 * index));
    this.check(this.core.fit());
  }
  // Returns the result of a call: up to `max` entries of `width` numbers each.
  read(max, width, call) {
    this.numbers(max * width);
    const count = call();
    return this.numbers(max * width).slice(0, count * width);
  }
  values() { return this.read(1 << 13, 1, () => this.core.values()); }
  atSamples(samples) { return this.read(samples, 3, () => this.core.at_samples()); }
  lobe(theta, steps) { return this.read(steps, 3, () => this.core.lobe(theta, steps)); }
  loss() { return this.core.loss(); }
  predictedLoss() { return this.core.predicted_loss(); }
  residual() { return this.core.residual(); }
  // Returns rows of a sphere's picture, as a view that is valid until the next call.
  shade(size, first, end, light) {
    this.numbers(3 * size * (end - first));
    this.core.shade(size, first, end, ...light);
    return this.numbers(3 * size * (end - first));
  }
}
