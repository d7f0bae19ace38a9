// The scene as a form: groups that fold, a field for every key with its number, unit and slider, its help and its fault.
//
// The form is made from the server's list of groups and fields, and kept while its structure stays: then values alone are
// put in, so that the focus, the hand on a slider and the folds are not disturbed.

import { element } from "./elements.js";
import { number, text, typed } from "./language.js";

const PAUSE = 800; // ms without an event after which a slider moved by keys begins a new step
const shapes = new WeakMap(); // of a group's element: the structure it was made for
const ranges = new Map(); // of a slider, by path and unit: kept while the value lies within
const narrow = matchMedia("(max-width: 56.24em)").matches; // where all groups are closed at first
const folded = new Map(); // paths of groups that were closed (true) or opened
const helped = new Set(); // paths of fields whose help is open
let kept = { of: null, good: new Map(), read: new Map() }; // of each field of one scene: as it was last without a fault, and with a number

const typing = new WeakSet(); // controls in which something was typed that is not entered yet
let arriving = null; // the path of what was added: it takes the focus when it is there
let host = null;
let send = () => {};
let gesture = { path: "", at: -Infinity, count: 0, down: false };

/** Put the form into an element; `change(edit, step, event time)` is called for every edit. */
export function formIn(into, change) {
  host = into;
  send = change;
  host.addEventListener("input", (event) => typing.add(event.target));
  host.addEventListener("change", (event) => typing.delete(event.target));
  host.addEventListener("pointerdown", () => (gesture.down = true));
  for (const name of ["pointerup", "pointercancel"]) {
    window.addEventListener(name, () => {
      gesture.down = false;
      gesture.at = -Infinity;
    });
  }
}

/** Show the groups of a scene with their values and faults; the values at `moving` paths are newer in the form than here. */
export function showForm(source, of, moving = new Set()) {
  if (kept.of !== of) kept = { of, good: new Map(), read: new Map() };
  const groups = source.map((group) => ({ ...group, fields: group.fields.map(withUnit) }));
  const focus = document.activeElement?.id;
  const inside = host.contains(document.activeElement);
  const old = new Map([...host.children].map((child) => [child.dataset.path, child]));
  const boxes = groups.map((group) => {
    const shape = structure(group);
    const same = old.get(group.path);
    if (same && shapes.get(same) === shape) return same;
    const made = groupOf(group);
    shapes.set(made, shape);
    return made;
  });
  if (boxes.length !== host.children.length || boxes.some((child, k) => host.children[k] !== child)) {
    host.replaceChildren(...boxes);
    if (inside) (document.getElementById(focus) ?? host.querySelector("summary"))?.focus({ preventScroll: true });
  }
  groups.forEach((group, k) => {
    for (const field of group.fields) if (!moving.has(field.path)) fill(field);
    const fault = boxes[k].querySelector(":scope > .fault");
    fault.hidden = !group.fault;
    fault.textContent = group.fault ?? "";
  });
  if (arriving !== null && leadTo(arriving, true)) arriving = null;
}

/** Make every group anew: another language. */
export function renewForm(groups, of) {
  host.replaceChildren();
  showForm(groups, of);
}

/** Lead to the field or group of a fault's path; false where the form has none. */
export function leadTo(path, exact = false) {
  let target = document.getElementById(idOf(path)) ?? host.querySelector(`[data-path="${CSS.escape(path)}"] summary`);
  for (let part = path; !exact && !target && part; part = part.replace(/(\.[^.[\]]*|\[\d+\]|^[^.[\]]+)$/, "")) {
    target = host.querySelector(`[data-path="${CSS.escape(part)}"] summary`);
  }
  if (!target) return false;
  for (let fold = target.closest("details"); fold; fold = fold.parentElement.closest("details")) fold.open = true;
  target.focus();
  target.scrollIntoView({ block: "center" });
  return true;
}

function idOf(path) {
  return `at-${path.replace(/[^\w-]/g, "_")}`;
}

function structure(group) {
  const fields = group.fields.map(({ path, label, about, kind, units, choices, range }) => [path, label, about, kind, units, choices, !!range]);
  return JSON.stringify([group.path, group.title, group.about, group.removable, group.more, fields]);
}

// -- units through faults ---------------------------------------------------------------------------------------------

/** A field that cannot be read keeps the kind, the unit and the slider that it had, and its last good value. */
function withUnit(field) {
  const { path, fault, number: value } = field;
  const numeric = value !== null && value !== undefined;
  if (numeric) kept.read.set(path, field);
  else if (!fault && field.kind === "expression") kept.read.delete(path);
  if (!fault && field.value) kept.good.set(path, field);
  const read = kept.read.get(path);
  const good = fault ? kept.good.get(path) : null;
  if (numeric || !read || !(fault || field.kind === read.kind) || (field.dimension && field.dimension !== read.dimension)) return { ...field, good };
  const { kind, unit, units, dimension, range, choices } = read;
  return { ...field, kind, unit, units, dimension, range, choices, good };
}

/** An item of a list goes: what is kept of those behind it moves up. */
function moveUp(path) {
  const [, list, at] = path.match(/^(.*)\[(\d+)\]$/) ?? [];
  if (list === undefined) return;
  for (const name of ["good", "read"]) {
    const moved = [...kept[name]].flatMap(([key, field]) => {
      const [, index, rest] = (key.startsWith(`${list}[`) && key.slice(list.length).match(/^\[(\d+)\](.*)$/)) || [];
      if (index === undefined || Number(index) < Number(at)) return [[key, field]];
      return index === at ? [] : [[`${list}[${index - 1}]${rest}`, field]];
    });
    kept[name] = new Map(moved);
  }
}

// -- groups -----------------------------------------------------------------------------------------------------------

function groupOf(group) {
  const made = element(
    "details",
    { class: `group level-${group.level ?? 0}`, "data-path": group.path, ontoggle: () => folded.set(group.path, !made.open) },
    element("summary", {}, element("h3", {}, group.title)),
    group.about ? element("p", { class: "about" }, group.about) : null,
    element("p", { class: "fault", hidden: true }),
    group.fields.map(fieldOf),
    footOf(group),
  );
  made.open = !(folded.get(group.path) ?? (narrow && group.path !== arriving));
  return made;
}

function footOf(group) {
  const more = group.more?.length ? adderOf(group) : null;
  const remove = group.removable ? removerOf(group.path, text("Remove"), text("Remove {name}", { name: group.title })) : null;
  return more || remove ? element("div", { class: "foot" }, more, remove) : null;
}

function removerOf(path, words, label) {
  return element(
    "button",
    { type: "button", class: "quiet", "aria-label": label, onclick: () => { moveUp(path); send({ path, value: null, key: `${path} removed` }, null); } },
    words,
  );
}

function adderOf(group) {
  const id = `${idOf(group.path)}-more`;
  const label = text("What to add to {name}", { name: group.title });
  const options = group.more.map((key) => element("option", { value: key.path }, key.label));
  const choice = element("select", { id, "aria-label": label }, element("option", { value: "" }, text("add …")), options);
  const name = element("input", { type: "text", spellcheck: "false", autocomplete: "off", "aria-label": text("Its name") });
  const about = element("p", { class: "about", id: `${id}-about` });
  choice.setAttribute("aria-describedby", about.id);
  const chosen = () => group.more.find((key) => key.path === choice.value);
  const update = () => {
    about.textContent = chosen()?.about ?? "";
    button.disabled = !chosen();
    name.hidden = !chosen()?.named;
    if (chosen()?.named) name.value = chosen().path.slice(chosen().path.lastIndexOf(".") + 1);
  };
  const add = () => {
    const { path, value, named } = chosen();
    const whole = named && /^[\w-]+$/.test(name.value.trim()) ? path.slice(0, path.lastIndexOf(".") + 1) + name.value.trim() : path;
    arriving = whole;
    send({ path: whole, value }, null);
  };
  const button = element("button", { type: "button", class: "quiet", "aria-label": text("Add to {name}", { name: group.title }), onclick: add }, text("Add"));
  choice.addEventListener("change", update);
  update();
  return element("div", { class: "adder" }, choice, name, button, about);
}

// -- fields -----------------------------------------------------------------------------------------------------------

function fieldOf(field) {
  const id = idOf(field.path);
  const about = element("p", { class: "about", id: `${id}-about`, hidden: !helped.has(field.path) }, field.about ? `${field.about} ` : "", element("code", {}, field.path));
  const help = element("button", { type: "button", class: "help", "aria-label": text("Help on {name}", { name: field.label }), "aria-expanded": String(!about.hidden), "aria-controls": about.id }, "?");
  help.addEventListener("click", () => {
    about.hidden = !about.hidden;
    help.setAttribute("aria-expanded", String(!about.hidden));
    if (about.hidden) helped.delete(field.path);
    else helped.add(field.path);
  });
  const wide = ["text", "expression", "table", "list"].includes(field.kind);
  return element(
    "div",
    { class: wide ? "field wide" : "field", "data-field": field.path },
    element("label", { for: id }, field.label),
    element("span", { class: "value" }, inputOf(field, id), unitOf(field, id)),
    help,
    sliderOf(field, id),
    field.kind !== "choice" && field.choices?.length ? element("datalist", { id: `${id}-choices` }, field.choices.map((value) => element("option", { value }))) : null,
    element("p", { class: "fault", id: `${id}-fault`, hidden: true }),
    about,
  );
}

function inputOf(field, id) {
  const described = { id, "data-of": field.path, "aria-describedby": `${id}-fault ${id}-about` };
  if (field.kind === "choice") {
    const options = field.choices.map((choice) => element("option", { value: choice }, choice || "–"));
    const made = element("select", described, options);
    made.addEventListener("change", () => commit(field.path, made.value));
    return made;
  }
  if (field.kind === "boolean") {
    const made = element("input", { ...described, type: "checkbox" });
    made.addEventListener("change", () => commit(field.path, String(made.checked)));
    return made;
  }
  if (!field.choices?.length && ["table", "list", "expression"].includes(field.kind)) {
    const made = element("textarea", { ...described, rows: 1, spellcheck: "false", autocomplete: "off" });
    made.addEventListener("change", () => commit(field.path, made.value.trim()));
    made.addEventListener("keydown", (event) => {
      if (event.key === "Enter" && !event.shiftKey) {
        event.preventDefault();
        made.dispatchEvent(new Event("change", { bubbles: true }));
      }
    });
    return made;
  }
  const numeric = field.kind === "quantity" || field.kind === "number";
  const made = element("input", { ...described, type: "text", inputmode: numeric ? "decimal" : null, spellcheck: "false", autocomplete: "off", list: field.choices?.length ? `${id}-choices` : null });
  made.addEventListener("change", () => commit(field.path, numeric ? quantity(made.value, unitIn(field.path)) : made.value));
  made.addEventListener("keydown", (event) => {
    if (event.key === "Enter") made.dispatchEvent(new Event("change", { bubbles: true }));
  });
  return made;
}

function unitOf(field, id) {
  const units = field.units ?? [];
  if (units.length < 2) return field.unit ? element("span", { class: "unit", "data-unit": field.unit }, symbol(field.unit)) : null;
  const made = element(
    "select",
    { id: `${id}-unit`, class: "unit", "data-unit-of": field.path, "aria-label": text("Unit of {name}", { name: field.label }) },
    units.map((unit) => element("option", { value: unit }, symbol(unit))),
  );
  made.addEventListener("change", () => {
    const input = document.getElementById(id);
    const read = kept.read.get(field.path);
    if (input.closest(".field").dataset.unread) kept.read.set(field.path, { ...(read ?? field), unit: made.value });
    else if (input.value.trim()) send({ path: field.path, unit: made.value, key: `${field.path} unit` }, null);
  });
  return made;
}

/** A unit of a scene as it is read: kg m^2 as kg m². */
function symbol(unit) {
  return unit.replace(/\^2/g, "²").replace(/\^3/g, "³").replace(/\^4/g, "⁴").replace("*", "·") || "–";
}

function sliderOf(field, id) {
  if (!field.range) return null;
  const made = element("input", { id: `${id}-slider`, class: "slider", type: "range", "data-slider-of": field.path, "aria-label": text("{name}, slider", { name: field.label }) });
  made.addEventListener("input", (event) => {
    const unit = unitIn(field.path);
    const value = String(Number(made.valueAsNumber.toPrecision(10)));
    document.getElementById(id).value = number(value);
    made.setAttribute("aria-valuetext", `${number(value)} ${unit}`.trim());
    commit(field.path, quantity(value, unit), stepOf(field.path), Math.min(event.timeStamp, performance.now()));
  });
  return made;
}

function stepOf(path) {
  // A drag is one step from the pointer's going down to its coming up; keys make one step as long as they follow quickly.
  const now = performance.now();
  if (gesture.path !== path || (!gesture.down && now - gesture.at > PAUSE)) {
    gesture = { path, at: now, count: gesture.count + 1, down: gesture.down };
  }
  gesture.at = now;
  return `${path} ${gesture.count}`;
}

function commit(path, value, step = null, event = performance.now()) {
  const field = host.querySelector(`[data-field="${CSS.escape(path)}"]`);
  if (field.dataset.value === value) return;
  field.dataset.value = value;
  send({ path, value }, step, event);
}

function unitIn(path) {
  const select = host.querySelector(`[data-unit-of="${CSS.escape(path)}"]`);
  return select ? select.value : (host.querySelector(`[data-field="${CSS.escape(path)}"] .unit`)?.dataset.unit ?? "");
}

function quantity(written, unit) {
  const plain = typed(written);
  return /^[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?$/i.test(plain) && unit ? `${plain} ${unit}` : plain;
}

// -- values -----------------------------------------------------------------------------------------------------------

function fill(field) {
  const id = idOf(field.path);
  const input = document.getElementById(id);
  const box = input.closest(".field");
  box.dataset.value = field.value ?? "";
  const readable = field.number !== null && field.number !== undefined;
  if (readable || !field.value) delete box.dataset.unread;
  else box.dataset.unread = "yes";
  if (input.type === "checkbox") input.checked = field.value === "true" || field.value === true;
  else if (!typing.has(input)) show(input, field);
  const unit = document.getElementById(`${id}-unit`);
  if (unit && ![...unit.options].some((option) => option.value === field.unit)) unit.prepend(element("option", { value: field.unit }, symbol(field.unit)));
  if (unit) unit.value = field.unit ?? "";
  const slider = document.getElementById(`${id}-slider`);
  if (slider) slide(slider, field);
  tell(input, document.getElementById(`${id}-fault`), field.fault, field.good && field.good.value !== field.value ? backOf(field) : null);
}

/** The button that puts back the last value of a field that had no fault. */
function backOf({ path, good }) {
  const words = good.number !== null ? `${number(Number(good.number.toPrecision(12)))} ${good.unit ? symbol(good.unit) : ""}`.trim() : good.value;
  const act = () => {
    typing.delete(document.getElementById(idOf(path)));
    commit(path, good.value);
  };
  return element("button", { type: "button", class: "quiet back", onclick: act }, text("Back to {value}", { value: words }));
}

function show(input, field) {
  const plain = field.kind === "quantity" || field.kind === "number";
  const value = plain && field.number !== null && field.number !== undefined ? number(Number(field.number.toPrecision(12))) : (field.value ?? "");
  if (input.matches("select") && ![...input.options].some((option) => option.value === value)) {
    input.prepend(element("option", { value }, value || "–"));
  }
  input.value = value;
  if (input.matches("textarea")) input.rows = Math.min(6, Math.max(1, Math.ceil(value.length / 30), value.split("\n").length));
}

function slide(slider, field) {
  const value = field.number ?? (field.good?.unit === field.unit ? field.good?.number : null) ?? null;
  if (value === null || !field.range) {
    slider.disabled = true;
    return;
  }
  slider.disabled = false;
  if (gesture.down && document.activeElement === slider) return;
  const key = `${field.path} ${field.unit}`;
  const last = ranges.get(key);
  const inside = last && value > last.least && value < last.most;
  const range = inside || (document.activeElement === slider && last) ? last : field.range;
  ranges.set(key, range);
  Object.assign(slider, { min: range.least, max: range.most, step: range.step ?? "any" });
  slider.value = value;
  slider.setAttribute("aria-valuetext", `${number(Number(value.toPrecision(6)))} ${field.unit ?? ""}`.trim());
}

function tell(input, place, fault, back) {
  place.hidden = !fault;
  place.replaceChildren(fault ?? "", ...(back ? [" ", back] : []));
  if (fault) input.setAttribute("aria-invalid", "true");
  else input.removeAttribute("aria-invalid");
}
