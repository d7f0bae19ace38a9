// The scene as text: line numbers, and each fault beside its line.

import { element } from "./elements.js";
import { text } from "./language.js";

const PAUSE = 800; // ms without a key after which typing begins a new step

let area = null;
let gutter = null;
let marks = null;
let steps = 0;
let last = -Infinity;

/** Put the editor into an element; `change(text, step)` is called as it is typed. */
export function editorIn(host, change) {
  area = element("textarea", { id: "text", spellcheck: "false", autocomplete: "off", autocapitalize: "off", wrap: "off", "aria-describedby": "faults" });
  gutter = element("div", { class: "gutter", "aria-hidden": "true" });
  marks = element("div", { class: "marks", "aria-hidden": "true" });
  area.addEventListener("input", () => {
    const now = performance.now();
    if (now - last > PAUSE) steps += 1;
    last = now;
    count();
    change(area.value, `text ${steps}`);
  });
  area.addEventListener("scroll", scroll);
  area.addEventListener("beforeinput", (event) => {
    if (event.inputType.startsWith("history")) event.preventDefault(); // steps are the page's own
  });
  host.replaceChildren(gutter, element("div", { class: "sheet" }, marks, area));
  nameEditor();
}

/** Name the text area in the language in use. */
export function nameEditor() {
  area.setAttribute("aria-label", text("Text of the scene, TOML"));
}

/** Show this text, with the faults beside their lines. */
export function showText(written, faults, remarks = []) {
  if (area.value !== written) {
    const { selectionStart, selectionEnd, scrollTop } = area;
    area.value = written;
    area.setSelectionRange(selectionStart, selectionEnd);
    area.scrollTop = scrollTop;
    last = -Infinity;
  }
  count();
  mark(faults, remarks);
}

/** Lead to a line, counted from 1. */
export function leadToLine(line) {
  const lines = area.value.split("\n");
  const start = lines.slice(0, line - 1).reduce((sum, one) => sum + one.length + 1, 0);
  area.focus();
  area.setSelectionRange(start, start + (lines[line - 1]?.length ?? 0));
  const height = parseFloat(getComputedStyle(area).lineHeight);
  area.scrollTop = Math.max(0, (line - 1) * height - area.clientHeight / 3);
  scroll();
}

function count() {
  const lines = area.value.split("\n").length;
  if (gutter.childElementCount === lines) return;
  gutter.replaceChildren(...Array.from({ length: lines }, (_, k) => element("div", {}, String(k + 1))));
}

function mark(faults, remarks) {
  for (const line of gutter.children) line.className = "";
  const lines = area.value.split("\n");
  const byLine = new Map();
  for (const [kind, list] of [["fault", faults], ["remark", remarks]]) {
    for (const { line, message } of list) {
      if (!line || line > lines.length) continue;
      if (!byLine.has(line)) byLine.set(line, { kind, messages: [] });
      byLine.get(line).messages.push(message);
      gutter.children[line - 1].classList.add(byLine.get(line).kind);
    }
  }
  marks.replaceChildren(
    ...[...byLine].map(([line, { kind, messages }]) => {
      const made = element("div", { class: `mark ${kind}` }, element("span", { class: "ghost" }, lines[line - 1]), element("span", { class: "told" }, messages.join(" · ")));
      made.style.top = `calc(${line - 1} * var(--row) + var(--pad))`;
      return made;
    }),
  );
  if (faults.length) area.setAttribute("aria-invalid", "true");
  else area.removeAttribute("aria-invalid");
  scroll();
}

function scroll() {
  gutter.style.transform = `translateY(${-area.scrollTop}px)`;
  marks.style.transform = `translate(${-area.scrollLeft}px, ${-area.scrollTop}px)`;
}
