/** A printed kernel with its memory. */

export class Kernel {
  /** @param {(M: Float64Array) => void} code @param {{in: number[][], out: number[][]}} layout */
  constructor(code, layout) {
    this.code = code;
    this.memory = new Float64Array(code.size);
    this.inputs = layout.in.map(([at, count]) => this.memory.subarray(at, at + count));
    this.outputs = layout.out.map(([at, count]) => this.memory.subarray(at, at + count));
  }

  /** Run it; the outputs are overwritten by the next run. @param {ArrayLike<number>[]} given */
  run(...given) {
    for (let k = 0; k < given.length; k += 1) this.inputs[k].set(given[k]);
    this.code(this.memory);
    return this.outputs;
  }
}
