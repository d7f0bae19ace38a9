// What the browser keeps: a reader's settings, and a copy of edits that are not saved, for this tab alone; for all tabs
// where the page belongs to an earlier start of the program, as the next one may be opened in another tab.

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

/** The copy of this scene's unsaved edits that the tab, or one of an earlier start, kept; null where there is none. */
export function copyOf(name) {
  return read(sessionStorage, `${COPY} ${name}`) ?? read(localStorage, `${COPY} ${name}`);
}

/** Keep a copy of a scene's unsaved edits, for all tabs if so wanted; null drops it. */
export function keepCopy(name, copy, all = false) {
  if (copy) keep(sessionStorage, `${COPY} ${name}`, copy);
  else forget(sessionStorage, `${COPY} ${name}`);
  if (copy && all) keep(localStorage, `${COPY} ${name}`, copy);
}

/** Drop what a page of an earlier start has left for all tabs. */
export function dropLeft(name) {
  forget(localStorage, `${COPY} ${name}`);
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

function forget(storage, key) {
  try {
    storage.removeItem(key);
  } catch {
    // As above.
  }
}
