// The language of the page: texts by their English, as the catalogues have them, and numbers with the decimal mark.

const english = new WeakMap(); // of a text node or an element: what it says in English
const LABELS = ["aria-label", "title", "placeholder"];

let current = "en";
let catalogue = {};

/** The message in the language in use, English where it has no translation, with values put in: {name}. */
export function text(message, values) {
  const words = catalogue[message] ?? message;
  return values ? words.replace(/\{(\w+)\}/g, (whole, key) => (key in values ? String(values[key]) : whole)) : words;
}

/** A number as written in English, with the decimal mark of the language in use. */
export function number(written) {
  const plain = String(written);
  return current === "es" ? plain.replace(/(\d)\.(?=\d)/g, "$1,") : plain;
}

/** What somebody typed as a number in the language in use, as scenes write it: 0,5 is 0.5 in Spanish. */
export function typed(written) {
  const plain = written.trim();
  return current === "es" ? plain.replace(/(\d),(?=\d)/g, "$1.") : plain;
}

/** The language in use, "en" or "es". */
export function language() {
  return current;
}

/** Take a language with its texts, {english: translation}, and tell the document in it. */
export function speak(name, texts) {
  current = name;
  catalogue = texts;
  document.documentElement.lang = name;
  translate(document.body);
}

/** Tell texts and labels that stand in the page's HTML in the language in use; what is marked translate="no" stays. */
export function translate(root) {
  for (const element of root.querySelectorAll(LABELS.map((name) => `[${name}]`).join())) {
    if (element.closest("[translate=no]") === null) labels(element);
  }
  const walker = document.createTreeWalker(root, NodeFilter.SHOW_TEXT);
  for (let node = walker.nextNode(); node; node = walker.nextNode()) {
    if (!node.data.trim() || node.parentElement.closest("[translate=no]")) continue;
    if (!english.has(node)) english.set(node, node.data.trim().replace(/\s+/g, " "));
    node.data = catalogue[english.get(node)] ?? english.get(node);
  }
}

function labels(element) {
  const originals = english.get(element) ?? {};
  for (const name of LABELS) {
    if (!element.hasAttribute(name)) continue;
    originals[name] ??= element.getAttribute(name);
    element.setAttribute(name, catalogue[originals[name]] ?? originals[name]);
  }
  english.set(element, originals);
}
