// What the browser keeps: a reader's settings, and a copy of edits that are not saved, for this tab alone.

const SETTINGS = "flywheel settings";
const COPY = "flywheel copy";

/** A setting that was kept, or this one. */
export function remembered(name, otherwise) {
  return read(localStorage, SETTINGS)?.[name] ?? otherwise;
}

/** Keep a setting. */
export function remember(name, value) {
  keep(localStorage, SETTINGS, { ...read(localStorage, SETTINGS), [name]: value });
}

/** The copy of this scene's unsaved edits that the tab kept: {text, saved, seen}; null where there is none. */
export function copyOf(name) {
  return read(sessionStorage, `${COPY} ${name}`);
}

/** Keep a copy of a scene's unsaved edits; null drops it. */
export function keepCopy(name, copy) {
  if (copy) keep(sessionStorage, `${COPY} ${name}`, copy);
  else forget(`${COPY} ${name}`);
}

function read(storage, key) {
  try {
    return JSON.parse(storage.getItem(key));
  } catch {
    return null; // no storage, or nothing that is ours
  }
}

function keep(storage, key, value) {
  try {
    storage.setItem(key, JSON.stringify(value));
  } catch {
    // A browser that keeps nothing: the page works without.
  }
}

function forget(key) {
  try {
    sessionStorage.removeItem(key);
  } catch {
    // As above.
  }
}
