// The numbers of the page of answers: blocks of rows, tables and sentences, as the library words them.

import { element } from "./elements.js";
import { text } from "./language.js";

let open = false; // the machine as it was read

/** Show the blocks in an element: what is chosen, beside it how the machine then runs, below it how it was read. */
export function showNumbers(host, blocks) {
  const of = (...names) => blocks.filter((block) => names.includes(block.name)).map(blockOf);
  const chosen = ["parts", "flywheel", "wheel", "stroke", "shares"];
  const rest = blocks.filter((block) => !["title", "machine", ...chosen].includes(block.name)).map(blockOf);
  host.replaceChildren(element("div", {}, of(...chosen)), element("div", {}, rest), ...of("machine"));
}

/** Let the keyboard scroll the tables that are wider than their place. */
export function reachable(host) {
  for (const box of host.querySelectorAll(".wide-table")) {
    if (box.scrollWidth > box.clientWidth) Object.assign(box, { tabIndex: 0, role: "group", ariaLabel: box.firstElementChild.ariaLabel });
  }
}

/** What a second route says of the answer: it stands beside the heading, so that nothing moves when it comes. */
export function secondRoute(blocks) {
  return (blocks.find((block) => block.name === "run")?.sentences ?? []).join(" ");
}

function blockOf(block) {
  const parts = [block.rows?.length ? rowsOf(block) : null, block.table?.length ? tableOf(block) : null, sentencesOf(block)];
  if (block.name !== "machine") {
    return element("section", { class: `block ${block.name}` }, block.title ? element("h3", {}, block.title) : null, parts);
  }
  const made = element("details", { class: "block machine", ontoggle: () => (open = made.open) }, element("summary", {}, block.title || text("Input summary")), parts);
  made.open = open;
  return made;
}

function rowsOf(block) {
  const rows = block.rows.map((row) => {
    const wordy = !row.unit && !row.note;
    const figure = /^[^\p{L}]*\p{N}/u.test(row.value); // stays in one line; words may take several
    return element(
      "tr",
      {},
      element("th", { scope: "row" }, row.label),
      element("td", { class: figure && !wordy ? "figure" : "words", colspan: wordy ? 2 : null }, row.value, row.unit ? ` ${row.unit}` : ""),
      wordy ? null : element("td", { class: "note" }, row.note ?? ""),
    );
  });
  return element("div", { class: "wide-table" }, element("table", { "aria-label": block.title || text("Results") }, element("tbody", {}, rows)));
}

function tableOf(block) {
  const head = block.header?.length ? element("thead", {}, element("tr", {}, block.header.map((cell, k) => headOf(cell, k)))) : null;
  const rows = block.table.map((cells) => element("tr", {}, cells.map((cell, k) => (k ? element("td", { class: "figure" }, cell) : element("th", { scope: "row" }, cell)))));
  return element("div", { class: "wide-table" }, element("table", { "aria-label": block.title || text("Results") }, head, element("tbody", {}, rows)));
}

function headOf(cell, k) {
  return cell ? element("th", { scope: "col", class: k ? "figure" : null }, cell) : element("td");
}

function sentencesOf(block) {
  return (block.name === "run" ? [] : (block.sentences ?? [])).map((sentence) => element("p", {}, sentence));
}
