// Elements of the page made from script: every text goes in as text, never as markup.

/** An element with attributes, listeners (onclick: ...) and children (elements or texts; null is left out). */
export function element(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith("on")) made.addEventListener(key.slice(2), value);
    else if (key in { value: 0, checked: 0, disabled: 0, hidden: 0, selected: 0 }) made[key] = value;
    else if (value !== null && value !== undefined && value !== false) made.setAttribute(key, value === true ? "" : value);
  }
  made.append(...children.flat(Infinity).filter((child) => child !== null && child !== undefined));
  return made;
}

/** The element of the page with this id. */
export function byId(id) {
  return document.getElementById(id);
}

/** Give the browser's user a file of this name. */
export function download(name, blob) {
  const address = URL.createObjectURL(blob);
  const link = element("a", { href: address, download: name });
  document.body.append(link);
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(address), 60000);
}

/** A file's name without what systems do not allow in one. */
export function fileName(words, ending) {
  const plain = words.normalize("NFKD").replace(/[^\w. -]+/g, "").trim().replace(/\s+/g, "_").slice(0, 80);
  return `${plain || "scene"}.${ending}`;
}
