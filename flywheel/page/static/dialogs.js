// Dialogs: each takes the focus, is left by Escape, and gives the focus back to where it came from.

import { element } from "./elements.js";
import { number, text } from "./language.js";

const MOST_LINES = 4000; // of two texts that are compared line by line

/** Ask with a dialog; the value of the button that closed it, "" where it was left. `parts` stand above the buttons. */
export function ask(title, parts, buttons) {
  const heading = element("h2", { id: "dialog-title" }, title);
  const foot = buttons.map(({ value, words, main, submit = true }) =>
    element("button", { type: submit ? "submit" : "button", value, class: main ? "main" : null, formnovalidate: value === "" }, words),
  );
  const form = element("form", { method: "dialog" }, heading, parts, element("div", { class: "foot" }, foot));
  const dialog = element("dialog", { "aria-labelledby": "dialog-title" }, form);
  const from = document.activeElement;
  document.body.append(dialog);
  return new Promise((closed) => {
    // The form is never sent anywhere: its buttons close the dialog.
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      dialog.close(event.submitter?.value ?? "");
    });
    dialog.addEventListener("close", () => {
      dialog.remove();
      from?.focus?.();
      closed(dialog.returnValue);
    });
    dialog.returnValue = "";
    dialog.showModal();
    dialog.querySelector("[autofocus]")?.focus();
  });
}

/** What differs between two texts, as a list of lines: "theirs" and "mine" with three lines around each change. */
export function differences(theirs, mine, names) {
  const lines = compared(theirs.split("\n"), mine.split("\n"));
  if (!lines) return element("p", {}, text("The two texts are too long to compare here."));
  if (lines.every((line) => line.kind === "same")) return element("p", {}, text("Nothing differs."));
  const near = lines.map((_line, k) => lines.slice(Math.max(0, k - 2), k + 3).some((line) => line.kind !== "same"));
  const items = lines.flatMap((line, k) => (near[k] ? [lineOf(line)] : near[k - 1] ? [element("li", { class: "gap" }, "…")] : []));
  return element(
    "div",
    {},
    element("p", { class: "legend" }, element("span", { class: "theirs" }, `− ${names.theirs}`), " ", element("span", { class: "mine" }, `+ ${names.mine}`)),
    element("ol", { class: "differences", tabindex: "0", role: "list", "aria-label": text("What differs") }, items),
  );
}

function lineOf({ kind, words }) {
  const sign = { same: " ", theirs: "−", mine: "+" }[kind];
  return element("li", { class: kind }, `${sign} ${words}`);
}

function compared(theirs, mine) {
  if (theirs.length > MOST_LINES || mine.length > MOST_LINES) return null;
  let head = 0;
  while (head < theirs.length && head < mine.length && theirs[head] === mine[head]) head += 1;
  let tail = 0;
  while (tail < theirs.length - head && tail < mine.length - head && theirs.at(-1 - tail) === mine.at(-1 - tail)) tail += 1;
  const same = (words) => ({ kind: "same", words });
  return [
    ...theirs.slice(0, head).map(same),
    ...middle(theirs.slice(head, theirs.length - tail), mine.slice(head, mine.length - tail)),
    ...theirs.slice(theirs.length - tail).map(same),
  ];
}

/** The longest common subsequence of what lies between equal beginnings and ends; all of it where that is too long. */
function middle(theirs, mine) {
  const gone = theirs.map((words) => ({ kind: "theirs", words }));
  const come = mine.map((words) => ({ kind: "mine", words }));
  if (theirs.length * mine.length > 1e6) return [...gone, ...come];
  const common = Array.from({ length: theirs.length + 1 }, () => new Uint16Array(mine.length + 1));
  for (let i = theirs.length - 1; i >= 0; i -= 1) {
    for (let j = mine.length - 1; j >= 0; j -= 1) {
      common[i][j] = theirs[i] === mine[j] ? common[i + 1][j + 1] + 1 : Math.max(common[i + 1][j], common[i][j + 1]);
    }
  }
  const lines = [];
  let [i, j] = [0, 0];
  while (i < theirs.length && j < mine.length) {
    if (theirs[i] === mine[j]) {
      lines.push({ kind: "same", words: theirs[i] });
      i += 1;
      j += 1;
    } else if (common[i + 1][j] >= common[i][j + 1]) lines.push(gone[i++]);
    else lines.push(come[j++]);
  }
  return [...lines, ...gone.slice(i), ...come.slice(j)];
}

/** Ask for a file's name in the scene's folder; null where it was left. */
export async function askName(name, why = null) {
  const input = element("input", { id: "file-name", type: "text", value: name, required: true, autofocus: true, autocomplete: "off", spellcheck: "false", "aria-describedby": "file-why" });
  const parts = [
    element("p", { id: "file-why" }, why ?? text("The file is written into the folder of the scene; its name ends in .toml.")),
    element("p", {}, element("label", { for: "file-name" }, text("Name of the file")), " ", input),
  ];
  const chosen = await ask(text("Save as"), parts, [
    { value: "save", words: text("Save"), main: true },
    { value: "", words: text("Cancel") },
  ]);
  return chosen === "save" && input.value.trim() ? input.value.trim() : null;
}

/** Ask which starter or example to begin with; its id, or null. */
export async function askStart(examples, unsaved) {
  const groups = [...new Set(examples.map((example) => example.group))];
  const list = element(
    "select",
    { id: "start", size: 14, required: true, autofocus: true },
    groups.map((group) => element("optgroup", { label: groupName(group) }, examples.filter((example) => example.group === group).map((example) => element("option", { value: example.id }, example.title)))),
  );
  list.selectedIndex = 0;
  list.addEventListener("dblclick", () => list.form.requestSubmit(list.form.querySelector(".main")));
  const parts = [
    unsaved ? element("p", { class: "warning" }, text("Unsaved edits are kept as a step: Undo restores them.")) : null,
    element("p", {}, element("label", { for: "start" }, text("Starter or example")), list),
  ];
  const chosen = await ask(text("New scene"), parts, [
    { value: "open", words: text("Open"), main: true },
    { value: "", words: text("Cancel") },
  ]);
  return chosen === "open" ? list.value : null;
}

function groupName(group) {
  const names = {
    starters: text("Starters"),
    machines: text("Machines"),
    exams: text("Exams"),
    dynamics: text("Dynamics"),
    joint_forces: text("Forces in joints"),
    linkages: text("Linkages"),
    regimes: text("Regimes"),
    pictures: text("Pictures"),
    robot: text("Robots"),
    root_finding: text("Root finding"),
  };
  return names[group] ?? group;
}

/** Ask how much of a report, its form and its language: {cover_sheet, format, language}, or null. */
export async function askReport(language) {
  const radio = (name, value, words, checked) => element("label", {}, element("input", { type: "radio", name, value, checked, autofocus: name === "part" && checked }), " ", words);
  const part = element("fieldset", {}, element("legend", {}, text("Contents")), radio("part", "all", text("Whole report: every step with its formula, the numbers put in, and the result"), true), radio("part", "cover_sheet", text("Cover sheet alone, to sign"), false));
  const form = element("fieldset", {}, element("legend", {}, text("File")), radio("format", "html", text("HTML, for any browser"), true), radio("format", "pdf", text("PDF, A4"), false));
  const tongue = element("fieldset", {}, element("legend", {}, text("Language of the report")), radio("tongue", "en", "English", language === "en"), radio("tongue", "es", "Español", language === "es"));
  const chosen = await ask(text("Report"), [part, form, tongue], [
    { value: "make", words: text("Download"), main: true },
    { value: "", words: text("Cancel") },
  ]);
  if (chosen !== "make") return null;
  return { cover_sheet: part.querySelector(":checked").value === "cover_sheet", format: form.querySelector(":checked").value, language: tongue.querySelector(":checked").value };
}

/** Tell the keys and how the page is used. */
export function help(median) {
  const keys = [
    ["F1", text("this help")],
    ["Ctrl+S", text("save")],
    ["Ctrl+Z", text("one step back; a whole drag is one step")],
    ["Ctrl+Y, Ctrl+Shift+Z", text("one step forward")],
    ["Ctrl+Enter", text("play or pause")],
    ["Alt+1, Alt+2", text("scene as form, as text")],
    ["← →, Page Up, Page Down", text("on a slider: by a step, by ten")],
    ["Tab", text("from one control to the next")],
    ["Esc", text("leave a dialog")],
  ];
  const table = element(
    "table",
    { class: "keys" },
    element("tbody", {}, keys.map(([key, words]) => element("tr", {}, element("th", { scope: "row" }, element("kbd", {}, key)), element("td", {}, words)))),
  );
  const notes = [
    text("The form and the text are one scene: a change in one appears in the other; comments and layout are kept. You may type a number with another unit, such as 3.5 in."),
    text("While a slider moves, every figure follows; after the drag a simulation in time confirms the result."),
    text("Drag the crank, or point at a curve: one crank angle is marked in all figures."),
    text("No data leave this computer, and files are written only on your request."),
  ].map((words) => element("p", {}, words));
  const speed = median === null ? null : element("p", { class: "muted" }, text("Figures redrawn within {n} ms at the median.", { n: number(Math.round(median)) }));
  return ask(text("Help"), [table, notes, speed], [{ value: "", words: text("Close"), main: true }]);
}
