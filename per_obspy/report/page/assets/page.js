"use strict";
// The page as a whole: reads its data, fills the first screen, makes map and list.

class Page {
  constructor(content) {
    this.content = content;
    [this.pairs, this.cells, this.buildings] = content.tables;
    this.chosen = null;
    this.shownClasses = content.classes.map(() => true);
    this.shownStates = content.states.map(() => true);
    this.showsCells = true;
    this.isShown = new Uint8Array(this.pairs.count).fill(1);
    this.t = (key, values = {}) => {
      // The singular where a count is one
      const single = values.count === "1" ? content.texts[`${key}_one`] : undefined;
      const text = single || (content.texts[key] === undefined ? key : content.texts[key]);
      return text.replace(/\{(\w+)\}/g, (whole, name) => (name in values ? values[name] : whole));
    };
    // With so many decimals; without a number of them two digits, of what the contact law leaves uncertain
    const forms = {};
    this.number = (value, digits) => {
      if (!Number.isFinite(value)) return "–";
      // No minus before a zero
      const shown = Math.abs(value) < 0.5 * 10 ** -digits ? 0 : value;
      const form = digits === undefined ? { minimumSignificantDigits: 2, maximumSignificantDigits: 2 } : { minimumFractionDigits: digits, maximumFractionDigits: digits };
      // Made once each: that takes longer than to write a number
      forms[digits] = forms[digits] || new Intl.NumberFormat(content.language, { ...form, useGrouping: "always" });
      return forms[digits].format(shown);
    };
    this.setGrades();
    this.setBuildings();
  }

  whole(value) { return this.number(value, 0); }

  // A count, or a number with at most three digits; tiny ones would have dozens of zeros
  short(value) {
    if (Number.isInteger(value)) return this.whole(value);
    if (value !== 0 && Math.abs(value) < 0.001) return `< ${this.number(0.001, 3)}`;
    return value.toLocaleString(this.content.language, { maximumSignificantDigits: 3, useGrouping: "always" });
  }

  // A probability in percent: 0 and 100 only where it is exactly that
  percent(value) {
    if (value > 0 && value < 0.001) return `< ${this.number(0.1, 1)}`;
    if (value < 1 && value > 0.999) return `> ${this.number(99.9, 1)}`;
    const near = value > 0 && value < 1 && (value < 0.01 || value > 0.99);
    return this.number(100 * value, near ? 1 : 0);
  }

  setGrades() {
    this.stateCodes = this.codes("state", this.content.states);
    this.classCodes = this.codes("risk_class", this.content.classes);
  }

  // The number of each pair's state or class; the last one stands for what has none
  codes(name, grades) {
    const column = this.pairs.column[name];
    if (!column) return new Uint8Array(this.pairs.count).fill(grades.length - 1);
    const numbers = column.texts.map((text) => {
      const found = grades.findIndex((grade) => grade.name === text);
      return found < 0 ? grades.length - 1 : found;
    });
    return Uint8Array.from(column.codes, (code) => numbers[code]);
  }

  stateOf(pair) { return this.content.states[this.stateCodes[pair]]; }

  classOf(pair) { return this.content.classes[this.classCodes[pair]]; }

  setBuildings() {
    this.pairsOf = new Map();
    for (const name of ["building_id_1", "building_id_2"]) {
      (this.pairs.column[name] || []).forEach((building, i) => {
        if (!building) return;
        if (!this.pairsOf.has(building)) this.pairsOf.set(building, []);
        this.pairsOf.get(building).push(i);
      });
    }
    for (const pairs of this.pairsOf.values()) pairs.sort((a, b) => a - b);
    this.outlines = (this.content.outlines || []).map(([name, ring]) => ({ ring, pairs: this.pairsOf.get(name) || [] }));
    this.buildingRow = new Map();
    const names = this.buildings.column.building_id || [];
    names.forEach((name, i) => { if (!this.buildingRow.has(name)) this.buildingRow.set(name, i); });
  }

  // What is known of a building from its row of neighbours, as a sentence
  buildingFacts(name) {
    const i = this.buildingRow.get(name);
    if (i === undefined) return "";
    const { column } = this.buildings;
    const text = (values) => (values ? values.texts[values.codes ? values.codes[i] : i] : "");
    const said = [this.t("building_says", {
      rank: this.whole(column.rank[i]), neighbours: this.whole(column.neighbours[i]),
      hit: this.whole(column.neighbours_that_can_hit[i]), probability: this.percent(column.probability_common[i]),
    })];
    if (column.impacts && column.impacts[i] > 0) said.push(this.t("building_impacts", { count: this.whole(column.impacts[i]), velocity: this.number(column.impact_velocity[i]), high: this.number(column.impact_velocity_84?.[i]) }));
    const prevention = column.prevention ? column.prevention.texts[column.prevention.codes[i]] : "";
    if (prevention) said.push(this.t("building_prevention", { value: prevention }));
    return said.join(" ") + (text(column.position) ? ` (${this.t(`position_${text(column.position)}`)})` : "");
  }

  colourOf(pair) { return this.classOf(pair).colour; }

  shortText(pair) {
    const { column } = this.pairs;
    return `${column.pair_id[pair]}: ${this.stateOf(pair).label}, ${this.number(column.expected_impact_velocity[pair])} m/s`;
  }

  flagName(name) { return (this.content.flag_names || {})[name] || name.replaceAll("_", " "); }

  // Name of an input of a pair, as period_1
  inputName(name) {
    const side = /_[12]$/.test(name) ? ` ${name.slice(-1)}` : "";
    const key = `input_${side ? name.slice(0, -2) : name}`;
    const label = this.content.texts[key];
    return (label || name.replaceAll("_", " ").replace(/ [12]$/, "")) + side;
  }

  choose(pair, focus = false) {
    const before = this.chosen;
    this.chosen = pair;
    if (pair === null) {
      this.details.hide();
      byId("opened").textContent = "";
      const row = document.querySelector(`#pairs tr[data-pair="${before}"] button`);
      if (row) row.focus();
    } else {
      this.details.show(pair, focus);
      // One short sentence for screen readers; the panel itself is read by going there
      byId("opened").textContent = this.shortText(pair);
      const { column } = this.pairs;
      if (focus) this.map.show(column.longitude[pair], column.latitude[pair], 400);
    }
    this.list.mark();
    this.map.later();
  }

  fillFirstScreen() {
    const { content } = this;
    for (const place of document.querySelectorAll("[data-text]")) place.textContent = this.t(place.dataset.text);
    for (const place of document.querySelectorAll("[data-label]")) place.setAttribute("aria-label", this.t(place.dataset.label));
    document.title = `${content.title} – per_obspy`;
    say("title", content.title);
    this.fillAlert();
    this.fillCoverage();
    say("event", content.event);
    byId("revision").textContent = content.revision || "";
    say("expected", content.expected || "");
    byId("simulated").hidden = !content.simulated;
    byId("simulated").textContent = this.t("simulated");
    for (const [value, label] of content.numbers) {
      byId("numbers").append(element("div", {}, element("dt", {}, label), element("dd", {}, value)));
    }
    for (const text of content.first || []) byId("todo").append(element("li", {}, text));
    for (const text of content.sure) byId("sure").append(element("li", {}, text));
    byId("map").setAttribute("aria-label", this.t("map_help"));
    this.fillLegend();
  }

  fillAlert() {
    const { level, colour, sentence, status, levels } = this.content.alert;
    byId("alert").style.borderColor = colour;
    byId("alert").querySelector("strong").textContent = `${level}.`;
    byId("alert").querySelector("span").replaceChildren(...isolated(sentence));
    byId("status").textContent = status;
    byId("levels").textContent = levels;
  }

  // Rows of the file as a bar of shares, and in sentences
  fillCoverage() {
    const { content, t } = this;
    const [warning, ...others] = content.warns ? content.coverage : ["", ...content.coverage];
    if (warning) byId("coverage").append(element("p", { class: "warning" }, warning));
    const parts = content.coverage_bar.filter(([, count]) => count > 0);
    const all = parts.reduce((sum, [, count]) => sum + count, 0);
    const bar = element("div", { class: "shares", role: "img", "aria-label": t("coverage_bar") });
    const legend = element("p", { class: "small shares_legend" }, `${t("coverage_file")}: ${this.whole(all)}`);
    for (const [label, count, colour] of parts) {
      const part = element("span", {});
      part.style.flexGrow = String(count);
      part.style.backgroundColor = colour;
      bar.append(part);
      const mark = drawing("svg", { width: 12, height: 12, "aria-hidden": "true" });
      mark.append(drawing("rect", { width: 12, height: 12, fill: colour }));
      legend.append(element("span", {}, mark, `${label}: ${this.whole(count)}`));
    }
    byId("coverage").append(bar, legend);
    for (const text of others) byId("coverage").append(element("p", { class: "small" }, text));
  }

  // Cells are counts by class and state: they can follow no other filter
  noteCells(follow) {
    this.showsCells = follow;
    const values = { shown: this.whole(this.pairs.count), all: this.whole(this.content.pair_count) };
    byId("cells").textContent = this.cells.count ? this.t(follow ? "cells_note" : "cells_hidden", values) : "";
  }

  fillLegend() {
    const legend = byId("legend");
    legend.append(element("span", {}, this.t("legend")));
    for (const grade of this.content.classes) {
      if (grade.count) legend.append(element("span", {}, swatch(grade), `${grade.label}: ${this.whole(grade.count)}`));
    }
    const station = drawing("svg", { width: 14, height: 12, "aria-hidden": "true" });
    station.append(drawing("path", { d: "M7 1L13 11H1Z", fill: "none", stroke: "#222", "stroke-width": 1.3 }));
    if (this.content.stations.places.length) legend.append(element("span", {}, station, this.t("station")));
    if (this.content.epicentre) legend.append(element("span", {}, "☆ ", this.t("epicentre")));
  }

  fillRest() {
    const { stations, areas, rejected, provenance } = this.content;
    this.fillTable("stations", stations);
    this.stations.linkNames();
    this.fillTable("areas", areas);
    this.fillTable("rejected", rejected);
    document.querySelector("#rejected p").textContent = rejected.note;
    for (const [name, value] of provenance) {
      document.querySelector("#provenance dl").append(element("dt", {}, name), element("dd", {}, value));
    }
  }

  fillTable(name, { heads, rows }) {
    const section = byId(name);
    if (!rows.length) {
      if (name !== "rejected") section.hidden = true;
      return;
    }
    const isNumber = heads.map((_, i) => rows.some((row) => typeof row[i] === "number"));
    const head = element("tr", {}, ...heads.map((text, i) => element("th", { scope: "col", class: isNumber[i] ? "number" : "name" }, text)));
    const body = rows.map((row) => element("tr", {}, ...row.map((cell) => (typeof cell === "number"
      ? element("td", { class: "number" }, this.short(cell))
      : element("td", { class: cell.length > 30 ? "text" : "name", dir: "auto" }, cell)))));
    section.querySelector("div").append(element("table", {}, element("thead", {}, head), element("tbody", {}, ...body)));
  }
}

async function start() {
  const page = new Page(await unpacked(byId("data").textContent));
  page.fillFirstScreen();
  page.stations = new Stations(page);
  page.list = new PairList(page);
  page.details = new Details(page);
  performance.mark("drawing");
  page.map = new PairMap(byId("map"), page);
  performance.mark("drawn");
  // What is further down can wait
  setTimeout(() => { page.fillRest(); performance.mark("filled"); document.documentElement.dataset.ready = "yes"; });
}

start().catch((error) => {
  byId("title").textContent = `This browser cannot show the report: ${error.message}`;
  throw error;
});
