/** What a page holds deflated and written to the base 85. */

const DIGITS = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz!#$%&()*+-;.=>?@^_`{|}~";

/** Bytes from digits to the base 85, five for four bytes, the first ones of the last five. @param {string} text */
function bytesOf(text) {
  const values = new Map([...DIGITS].map((digit, k) => [digit, k]));
  const bytes = new Uint8Array(4 * Math.ceil(text.length / 5)), view = new DataView(bytes.buffer);
  for (let k = 0; k < text.length; k += 5) {
    let word = 0;
    for (let j = k; j < k + 5; j += 1) word = 85 * word + (values.get(text[j]) ?? 84);
    view.setUint32((4 * k) / 5, word);
  }
  return bytes.subarray(0, Math.floor((4 * text.length) / 5));
}

/** The text that was deflated; it fails where its checksum is another one. @param {string} text @returns {Promise<string>} */
export const inflated = async (text) => new Response(new Blob([bytesOf(text)]).stream().pipeThrough(new DecompressionStream("deflate"))).text();
