"use strict";
// Filters and the table of pairs, which sorts and exports what is filtered.

const PAGE_ROWS = 100;

// Columns of the table, with the factor to the unit of their heading and their decimals, if they have more than two digits
const LISTED = [
  ["rank", 1, 0], ["pair_id"], ["risk_class"], ["state"], ["probability", 100, 0],
  ["expected_impact_velocity", 1], ["gap", 100, 1], ["annual_probability", 100], ["gap_for_target", 100, 1],
  ["demand", 100, 1], ["missing_gap", 100, 1], ["expected_amplification", 1], ["station"],
];

class PairList {
  constructor(page) {
    this.page = page;
    this.columns = LISTED.filter(([name]) => page.pairs.column[name]);
    this.sorted = { name: "rank", ascending: true };
    this.rows = PAGE_ROWS;
    this.fields = {};
    this.makeFilters();
    this.makeHead();
    byId("more").addEventListener("click", () => { this.rows += 5 * PAGE_ROWS; this.fill(); });
    byId("clear").addEventListener("click", () => { byId("filters").reset(); this.apply(); });
    byId("export").addEventListener("click", () => this.download());
    this.filter();
  }

  makeFilters() {
    const { t, content, pairs } = this.page;
    const form = byId("filters");
    this.classes = this.boxes(t("risk_class"), content.classes);
    this.states = this.boxes(t("state"), content.states);
    this.number("probability", t("least_probability"), 100);
    this.number("velocity", t("least_velocity"), 100);
    this.choice("area", t("area"), pairs.column.area ? [...pairs.column.area.texts].sort() : []);
    this.makeFlags();
    const search = element("input", { type: "search", id: "search", maxlength: "120", placeholder: t("search_hint") });
    form.append(element("label", { class: "tall" }, t("search"), search));
    this.fields.search = search;
    form.addEventListener("input", () => this.apply());
    form.addEventListener("submit", (event) => event.preventDefault());
  }

  // Flags that occur, and whether any, all or none of those that are ticked is wanted
  makeFlags() {
    const { t, pairs } = this.page;
    const texts = pairs.column.flags ? pairs.column.flags.texts : [];
    const names = [...new Set(texts.flatMap((text) => text.split(" ")))].filter(Boolean).sort();
    this.flags = names.map((name) => element("input", { type: "checkbox", value: name, name: "flag" }));
    if (!names.length) return;
    const kind = element("select", { id: "flag", "aria-label": t("flag") });
    for (const name of ["any", "all", "none"]) kind.append(element("option", { value: name }, t(`flags_${name}`)));
    this.fields.flag = kind;
    const labels = this.flags.map((box) => element("label", {}, box, this.page.flagName(box.value)));
    this.flagCount = element("summary", {}, t("flags"));
    byId("filters").append(element("details", {}, this.flagCount, element("div", {}, kind, ...labels)));
  }

  // Codes of the texts of flags that pass, null if no flag is ticked
  flagCodes() {
    const { t, pairs } = this.page;
    const chosen = this.flags.filter((box) => box.checked).map((box) => box.value);
    if (this.flagCount) this.flagCount.textContent = chosen.length ? t("flags_chosen", { label: t("flags"), count: String(chosen.length) }) : t("flags");
    if (!chosen.length) return null;
    const kind = this.fields.flag.value;
    const passes = (text) => {
      const names = text.split(" ");
      if (kind === "all") return chosen.every((name) => names.includes(name));
      return chosen.some((name) => names.includes(name)) === (kind === "any");
    };
    const codes = new Set();
    pairs.column.flags.texts.forEach((text, code) => { if (passes(text)) codes.add(code); });
    return codes;
  }

  // Check boxes of classes or states that occur
  boxes(label, grades) {
    const group = element("fieldset", {}, element("legend", {}, label));
    const boxes = grades.map((grade) => {
      const box = element("input", { type: "checkbox", checked: "", value: grade.name });
      const mark = grade.colour ? [swatch(grade)] : [];
      if (grade.count) group.append(element("label", {}, box, ...mark, `${grade.label} (${this.page.whole(grade.count)})`));
      return box;
    });
    byId("filters").append(group);
    return boxes;
  }

  number(name, label, largest) {
    const field = element("input", { type: "number", id: name, min: "0", max: String(largest), step: "any", inputmode: "decimal" });
    byId("filters").append(element("label", { class: "tall" }, label, field));
    this.fields[name] = field;
  }

  choice(name, label, texts) {
    const field = element("select", { id: name });
    field.append(element("option", { value: "" }, this.page.t("any")));
    for (const text of texts.slice(0, 2000)) field.append(element("option", { value: text }, text || "–"));
    if (texts.length) byId("filters").append(element("label", { class: "tall" }, label, field));
    this.fields[name] = field;
  }

  makeHead() {
    const row = document.querySelector("#pairs thead tr");
    for (const [name, factor] of this.columns) {
      const button = element("button", { type: "button" }, this.page.t(`column_${name}`));
      button.addEventListener("click", () => this.sort(name));
      const head = element("th", { scope: "col", "data-column": name }, button);
      if (factor) head.className = "number";
      row.append(head);
    }
  }

  sort(name) {
    const again = this.sorted.name === name;
    // Names and ranks rise at first, other numbers fall: the worst is on top
    const rises = ["rank", "pair_id", "station", "gap", "state", "risk_class"].includes(name);
    this.sorted = { name, ascending: again ? !this.sorted.ascending : rises };
    this.rows = PAGE_ROWS;
    this.order();
    this.fill();
  }

  apply() {
    this.rows = PAGE_ROWS;
    this.filter();
    this.page.map.later();
  }

  filter() {
    const { pairs, stateCodes, classCodes } = this.page;
    const { column, count } = pairs;
    const states = this.states.map((box) => box.checked);
    const classes = this.classes.map((box) => box.checked);
    this.page.shownClasses = classes;
    this.page.shownStates = states;
    const probability = Number(this.fields.probability.value) / 100;
    const velocity = Number(this.fields.velocity.value);
    const area = this.codesOf("area", (text, chosen) => text === chosen);
    const flags = this.flagCodes();
    const matches = this.searched();
    this.page.noteCells(!probability && !velocity && !area && !flags && !matches);
    this.found = [];
    for (let i = 0; i < count; i += 1) {
      // A number that is missing passes only where nothing is asked of it
      const passes = states[stateCodes[i]] && classes[classCodes[i]]
        && (!probability || column.probability[i] >= probability)
        && (!velocity || column.expected_impact_velocity[i] >= velocity)
        && (!area || area.has(column.area.codes[i]))
        && (!flags || flags.has(column.flags.codes[i]))
        && (!matches || matches(i));
      this.page.isShown[i] = passes ? 1 : 0;
      if (passes) this.found.push(i);
    }
    this.order();
    this.fill();
  }

  codesOf(name, isChosen) {
    const chosen = this.fields[name].value;
    if (!chosen) return null;
    const codes = new Set();
    this.page.pairs.column[name].texts.forEach((text, code) => { if (isChosen(text, chosen)) codes.add(code); });
    return codes;
  }

  // A place (latitude, longitude) moves the map there; anything else is sought in names
  searched() {
    const sought = this.fields.search.value.trim().toLowerCase();
    if (!sought) return null;
    const { column } = this.page.pairs;
    const place = sought.match(/^(-?\d+(?:\.\d+)?)\s*[,; ]\s*(-?\d+(?:\.\d+)?)$/);
    if (place && Math.abs(place[1]) <= 90 && Math.abs(place[2]) <= 360) {
      const [latitude, longitude] = [Number(place[1]), Number(place[2])];
      if (this.page.map) this.page.map.show(longitude, latitude, 1000);
      const shrink = Math.cos((latitude * Math.PI) / 180);
      return (i) => Math.hypot((column.longitude[i] - longitude) * shrink, column.latitude[i] - latitude) < 1000 / 111200;
    }
    const texts = ["pair_id", "building_id_1", "building_id_2"].map((name) => column[name]).filter(Boolean);
    // Names of places and areas are found by any part, stations by their whole name
    const places = ["address", "area"].map((name) => column[name]).filter(Boolean).map((values) => matching(values, sought));
    return (i) => texts.some((names) => names[i].toLowerCase().includes(sought))
      || places.some((found) => found(i))
      || (column.station && column.station.texts[column.station.codes[i]].toLowerCase() === sought);
  }

  order() {
    const { name, ascending } = this.sorted;
    const values = this.page.pairs.column[name];
    const sign = ascending ? 1 : -1;
    let value = (i) => values[i];
    if (values.codes) {
      const rank = { state: this.page.stateCodes, risk_class: this.page.classCodes }[name];
      value = rank ? (i) => rank[i] : (i) => values.texts[values.codes[i]];
    }
    const compare = (a, b) => {
      const [first, second] = [value(a), value(b)];
      if (Number.isNaN(first) || Number.isNaN(second)) return Number.isNaN(first) - Number.isNaN(second) || a - b;
      if (first === second) return a - b;
      return first < second ? -sign : sign;
    };
    this.found.sort(compare);
    for (const head of document.querySelectorAll("#pairs th")) {
      if (head.dataset.column === name) head.setAttribute("aria-sort", ascending ? "ascending" : "descending");
      else head.removeAttribute("aria-sort");
    }
  }

  fill() {
    const body = document.querySelector("#pairs tbody");
    const rows = this.found.slice(0, this.rows).map((i) => this.row(i));
    body.replaceChildren(...rows);
    const { t, pairs, content } = this.page;
    byId("count").textContent = t("count", { found: this.page.whole(this.found.length), shown: this.page.whole(pairs.count), all: this.page.whole(content.pair_count) });
    byId("more").hidden = this.found.length <= this.rows;
  }

  row(i) {
    const { page } = this;
    const made = element("tr", { "data-pair": String(i) });
    if (i === page.chosen) made.className = "chosen";
    for (const [name, factor, digits] of this.columns) {
      const values = page.pairs.column[name];
      if (factor) {
        const text = name === "probability" ? page.percent(values[i]) : page.number(factor * values[i], digits);
        made.append(element("td", { class: "number" }, text));
      } else if (name === "pair_id") {
        const button = element("button", { type: "button", dir: "auto" }, values[i]);
        button.addEventListener("click", () => page.choose(i, true));
        made.append(element("td", { class: "name" }, button));
      } else if (name === "state") {
        made.append(element("td", { class: "state" }, page.stateOf(i).label));
      } else if (name === "risk_class") {
        const grade = page.classOf(i);
        made.append(element("td", { class: "state" }, element("span", {}, swatch(grade), grade.label)));
      } else made.append(element("td", { class: "name" }, page.stations.link(values.texts[values.codes[i]])));
    }
    return made;
  }

  mark() {
    for (const row of document.querySelectorAll("#pairs tbody tr")) {
      row.className = Number(row.dataset.pair) === this.page.chosen ? "chosen" : "";
    }
  }

  csv() {
    const { column } = this.page.pairs;
    const names = Object.keys(column).filter((name) => name !== "prevention_kind");
    const lines = [names.map(quoted).join(",")];
    for (const i of this.found) lines.push(names.map((name) => cellText(column[name], i)).join(","));
    return `${lines.join("\r\n")}\r\n`;
  }

  download() {
    const address = URL.createObjectURL(new Blob(["\ufeff", this.csv()], { type: "text/csv;charset=utf-8" }));
    const link = element("a", { href: address, download: "pairs_filtered.csv" });
    link.click();
    setTimeout(() => URL.revokeObjectURL(address), 10000);
  }
}

// A cell of the export: numbers as they are, texts quoted and never a formula of a spreadsheet
function cellText(values, i) {
  const value = values.codes ? values.texts[values.codes[i]] : values[i];
  if (typeof value === "number") {
    if (!Number.isFinite(value)) return Number.isNaN(value) ? "" : String(value).replace("Infinity", "inf");
    return String(Number(value.toPrecision(9)));
  }
  return quoted(value);
}

// A text for a cell: quoted where it must be, and never a formula
function quoted(value) {
  const safe = /^[\s]*[=+\-@|\t\r]/.test(value) ? `'${value}` : value;
  return /[",\r\n]/.test(safe) || safe !== value ? `"${safe.replaceAll('"', '""')}"` : safe;
}

// Whether the text of a row has a part, each different text being looked at once
function matching(values, part) {
  if (!values.codes) return (i) => values[i].toLowerCase().includes(part);
  const codes = new Set();
  values.texts.forEach((text, code) => { if (text.toLowerCase().includes(part)) codes.add(code); });
  return (i) => codes.has(values.codes[i]);
}

// The mark of a class: its colour, and a bar that is the thicker the worse
function swatch(grade) {
  const picture = drawing("svg", { width: 18, height: 12, "aria-hidden": "true" });
  const height = 3 + 2 * grade.weight;
  picture.append(drawing("rect", { x: 0.5, y: 6 - height / 2, width: 17, height, fill: grade.colour, stroke: "#333" }));
  return picture;
}
