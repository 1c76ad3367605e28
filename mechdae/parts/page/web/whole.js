/** Whether a text is the one that was written: its CRC-32. */

/** @param {string} text @param {number} sum */
export function isWhole(text, sum) {
  let crc = 0xffffffff;
  for (const byte of new TextEncoder().encode(text)) {
    crc ^= byte;
    for (let k = 0; k < 8; k += 1) crc = (crc >>> 1) ^ (crc & 1 ? 0xedb88320 : 0);
  }
  return (crc ^ 0xffffffff) >>> 0 === sum;
}
