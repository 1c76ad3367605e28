/** Deflated data (RFC 1950, 1951) unpacked at once: a page begins before anything can wait. */

/** A table of a prefix code: how many codes of each length, and their symbols in order. */
function codeOf(lengths) {
  const counts = new Uint16Array(16), begins = new Uint16Array(16), symbols = [];
  for (const length of lengths) counts[length] += 1;
  counts[0] = 0;
  for (let k = 1; k < 16; k += 1) begins[k] = begins[k - 1] + counts[k - 1];
  lengths.forEach((length, symbol) => { if (length) symbols[begins[length]++] = symbol; });
  return { counts, symbols };
}

/** @param {Uint8Array} packed with the two bytes of zlib before and its checksum after @returns {string} */
export function inflated(packed) {
  let at = 2, held = 0, count = 0, size = 0;
  let out = new Uint8Array(8 * packed.length);
  const bits = (wanted) => {
    while (count < wanted) {
      held |= packed[at++] << count;
      count += 8;
    }
    const value = held & ((1 << wanted) - 1);
    held >>>= wanted;
    count -= wanted;
    return value;
  };
  const symbol = ({ counts, symbols }) => {
    let code = 0, first = 0, index = 0;
    for (let length = 1; length < 16; length += 1) {
      code |= bits(1);
      if (code - counts[length] < first) return symbols[index + code - first];
      index += counts[length];
      first = (first + counts[length]) << 1;
      code <<= 1;
    }
    throw new Error("altered");
  };
  const put = (byte) => {
    if (size === out.length) {
      const wider = new Uint8Array(2 * size);
      wider.set(out);
      out = wider;
    }
    out[size++] = byte;
  };
  const ORDER = [16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15];
  const tables = () => {
    const literals = bits(5) + 257, distances = bits(5) + 1, given = bits(4) + 4;
    const own = new Array(19).fill(0), lengths = [];
    for (let k = 0; k < given; k += 1) own[ORDER[k]] = bits(3);
    const code = codeOf(own);
    while (lengths.length < literals + distances) {
      const next = symbol(code);
      if (next < 16) lengths.push(next);
      else {
        const value = next === 16 ? lengths[lengths.length - 1] : 0;
        for (let k = next === 16 ? 3 + bits(2) : next === 17 ? 3 + bits(3) : 11 + bits(7); k > 0; k -= 1) lengths.push(value);
      }
    }
    return [codeOf(lengths.slice(0, literals)), codeOf(lengths.slice(literals))];
  };
  for (let last = 0; !last;) {
    last = bits(1);
    const kind = bits(2);
    if (kind === 0) {
      held = count = 0;
      const length = packed[at] + 256 * packed[at + 1];
      at += 4;
      for (let k = 0; k < length; k += 1) put(packed[at++]);
      continue;
    }
    const fixed = Array.from({ length: 288 }, (_, k) => (k < 144 ? 8 : k < 256 ? 9 : k < 280 ? 7 : 8));
    const [literals, distances] = kind === 2 ? tables() : [codeOf(fixed), codeOf(new Array(30).fill(5))];
    for (let next = symbol(literals); next !== 256; next = symbol(literals)) {
      if (next < 256) {
        put(next);
        continue;
      }
      if (at > packed.length + 4) throw new Error("altered");
      const k = next - 257, more = k < 8 || k === 28 ? 0 : (k >> 2) - 1;
      const length = k === 28 ? 258 : k < 8 ? k + 3 : ((4 + (k & 3)) << more) + 3 + bits(more);
      const far = symbol(distances), further = far < 4 ? 0 : (far >> 1) - 1;
      const back = (far < 4 ? far : (2 + (far & 1)) << further) + 1 + bits(further);
      for (let j = 0; j < length; j += 1) put(out[size - back]);
    }
  }
  let a = 1, b = 0;
  for (let k = 0; k < size; k += 1) {
    a = (a + out[k]) % 65521;
    b = (b + a) % 65521;
  }
  const sum = new DataView(packed.buffer, packed.byteOffset + packed.length - 4).getUint32(0);
  if (((b << 16) | a) >>> 0 !== sum) throw new Error("altered");
  return new TextDecoder().decode(out.subarray(0, size));
}

const DIGITS = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz!#$%&()*+-;.=>?@^_`{|}~";

/** Bytes from digits to the base 85, five for four bytes, the first ones of the last five. @param {string} text */
export function bytesOf(text) {
  const values = new Map([...DIGITS].map((digit, k) => [digit, k]));
  const bytes = new Uint8Array(4 * Math.ceil(text.length / 5)), view = new DataView(bytes.buffer);
  for (let k = 0; k < text.length; k += 5) {
    let word = 0;
    for (let j = k; j < k + 5; j += 1) word = 85 * word + (values.get(text[j]) ?? 84);
    view.setUint32((4 * k) / 5, word);
  }
  return bytes.subarray(0, Math.floor((4 * text.length) / 5));
}
