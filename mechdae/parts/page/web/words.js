/** Words of the page in its language: those of `words.toml` that it was written with. */

/** @param {string} key */
export const words = (key) => WORDS[key] || key;

/** A sentence with what stands for {0}, {1}, ... */
export const sentence = (key, ...parts) => words(key).replace(/\{(\d)\}/g, (_, k) => String(parts[k]));
