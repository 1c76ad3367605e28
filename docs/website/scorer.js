/** Order of the search: pages whose title says what is asked for, then the manual, then its history. */
const ASIDE = /^(docs\/history|docs\/theory\/evidence|CHANGELOG|problems\/)/;
const MADE = /^docs\/reference\/(keys|commands|gallery)$/;

function titled(title) {
  const stemmer = new Stemmer(), plain = (text) => text.toLowerCase().match(/[\w-]+/g) || [];
  const asked = plain(new URLSearchParams(location.search).get("q") || "").filter((word) => !stopwords.has(word));
  const said = new Set(plain(title).map((word) => stemmer.stemWord(word)));
  return asked.filter((word) => said.has(stemmer.stemWord(word))).length / (asked.length || 1);
}

var Scorer = {
  score: ([name, title, , , score]) => score + 60 * titled(title) - (ASIDE.test(name) ? 30 : MADE.test(name) ? 15 : 0),
  objNameMatch: 11, objPartialMatch: 6, objPrio: { 0: 15, 1: 5, 2: -5 }, objPrioDefault: 0,
  title: 15, partialTitle: 7, term: 5, partialTerm: 2,
};
