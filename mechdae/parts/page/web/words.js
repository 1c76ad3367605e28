/** Words of the page in its language: those of `words.toml` that it was written with. */

/** @param {string} key */
export const words = (key) => WORDS[key] || key;
