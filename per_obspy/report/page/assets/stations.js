"use strict";
// Everything about one station: its record, PER against SD, warnings.

const TOUCH = 12; // pixels: how near to its mark a click must be

class Stations {
  constructor(page) {
    this.page = page;
    this.place = byId("station");
    this.drawings = page.content.station_drawings || {};
    this.rows = new Map();
    for (const row of (page.content.stations.rows || [])) this.rows.set(row[0], row);
  }

  // A button with the name of a station, or the name alone where nothing is known of it
  link(name) {
    if (!this.rows.has(name)) return name;
    const button = element("button", { type: "button" }, name);
    button.addEventListener("click", () => this.show(name));
    return button;
  }

  linkNames() {
    for (const cell of document.querySelectorAll("#stations tbody td:first-child")) cell.replaceChildren(this.link(cell.textContent));
  }

  chooseAt(x, y) {
    const { map } = this.page;
    const found = this.page.content.stations.places.find(([, longitude, latitude]) => Math.hypot(map.x(longitude) - x, map.y(latitude) - y) < TOUCH);
    if (found) this.show(found[0]);
  }

  show(name) {
    const { t } = this.page;
    const { heads } = this.page.content.stations;
    const row = this.rows.get(name);
    if (!row) return;
    const close = element("button", { type: "button", class: "close" }, t("close"));
    close.addEventListener("click", () => { this.place.hidden = true; byId("stations").querySelector("button")?.focus(); });
    const facts = element("dl", { class: "small" });
    heads.forEach((head, i) => {
      if (i && row[i] !== "" && head !== t("head_warnings")) facts.append(element("div", {}, `${head}: ${typeof row[i] === "number" ? this.page.short(row[i]) : row[i]}`));
    });
    const warnings = row[heads.indexOf(t("head_warnings"))];
    const said = element("p", {}, warnings || t("station_clear"));
    this.place.replaceChildren(close, element("h2", {}, `${t("station")} ${name}`), facts, said, this.pairsButton(name), element("div", { class: "pictures" }, ...this.pictures(name)));
    this.place.hidden = false;
    this.place.focus();
  }

  // Pairs that the station serves become the filtered ones
  pairsButton(name) {
    const { t } = this.page;
    const button = element("button", { type: "button" }, t("show_pairs"));
    button.addEventListener("click", () => {
      byId("search").value = name;
      this.page.list.apply();
      byId("list").focus();
    });
    return element("p", {}, button);
  }

  pictures(name) {
    const drawn = this.drawings[name];
    const { t } = this.page;
    if (!drawn) return [element("p", { class: "small" }, t("station_none", { count: this.page.whole(Object.keys(this.drawings).length) }))];
    return [this.record(drawn), this.spectra(drawn)];
  }

  figure(caption, note, picture) {
    return element("figure", { class: "wide" }, element("figcaption", {}, caption), picture, element("p", { class: "small" }, note));
  }

  width() { return Math.max(300, Math.min(1150, document.documentElement.clientWidth - 60)); }

  // Both horizontals below each other, to one scale
  record(drawn) {
    const { t, number } = this.page;
    const caption = t("station_record");
    const width = this.width();
    const lines = [drawn.north, drawn.east].filter((line) => line.length);
    const bottom = 12 + 140 * lines.length;
    const picture = drawing("svg", { class: "picture", viewBox: `0 0 ${width} ${bottom + 20}`, role: "img", "aria-label": caption });
    const largest = lines.flat().reduce((most, value) => Math.max(most, Math.abs(value)), 1e-9);
    const length = drawn.step * (drawn.north.length / 2);
    const x = (time) => 44 + ((width - 54) * (time - drawn.start)) / (length || 1);
    const half = ticks(0, largest);
    const places = [...half.filter((tick) => tick > 0).map((tick) => -tick), ...half];
    lines.forEach((line, side) => {
      const y = (value) => 80 + 140 * side - (64 * value) / largest;
      this.axis(picture, places, y, width, tickDigits(0, largest));
      const points = line.map((value, at) => `${x(drawn.start + (drawn.step * (at + 0.5)) / 2).toFixed(1)},${y(value).toFixed(1)}`);
      picture.append(drawing("polyline", { points: points.join(" "), fill: "none", stroke: "#444", "stroke-width": 1 }));
    });
    for (const tick of ticks(drawn.start, drawn.start + length)) {
      picture.append(drawing("text", { x: x(tick), y: bottom + 12, "text-anchor": "middle", "font-size": 11 }, `${number(tick, tickDigits(drawn.start, drawn.start + length))} s`));
    }
    return this.figure(caption, t("station_record_note", { value: number(drawn.step, 2) }), picture);
  }

  spectra(drawn) {
    const { t } = this.page;
    const caption = t("station_spectra", { value: this.page.number(100 * drawn.damping, 0) });
    const width = this.width();
    const picture = drawing("svg", { class: "picture", viewBox: `0 0 ${width} 240`, role: "img", "aria-label": caption });
    const [first, last] = [drawn.period[0], drawn.period[drawn.period.length - 1]];
    const values = [...drawn.per, ...drawn.sd].filter((value) => value > 0);
    const [low, high] = [Math.log10(Math.min(...values)), Math.log10(Math.max(...values))];
    const x = (period) => 44 + ((width - 54) * Math.log(period / first)) / Math.log(last / first);
    const y = (value) => 208 - (196 * (Math.log10(value) - low)) / (high - low || 1);
    this.unusable(picture, drawn, x, first, last);
    const decades = [];
    for (let power = Math.ceil(low); power <= high; power += 1) decades.push(power);
    for (const power of decades) this.axis(picture, [10 ** power], y, width, Math.max(0, -power));
    for (const tick of [0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20]) {
      if (tick >= first * 0.999 && tick <= last * 1.001) picture.append(drawing("text", { x: x(tick), y: 226, "text-anchor": "middle", "font-size": 11 }, this.page.short(tick)));
    }
    [drawn.per, drawn.sd].forEach((line, side) => {
      const points = line.map((value, at) => (value > 0 ? `${x(drawn.period[at]).toFixed(1)},${y(value).toFixed(1)}` : "")).filter(Boolean);
      picture.append(drawing("polyline", { points: points.join(" "), fill: "none", stroke: this.page.content.building_colours[side], "stroke-width": 1.6, "stroke-dasharray": side ? "6 3" : "none" }));
    });
    return this.figure(caption, t("station_spectra_note"), picture);
  }

  unusable(picture, drawn, x, first, last) {
    const [shortest, longest] = drawn.usable || [];
    const shades = [[first, shortest], [longest, last]];
    for (const [from, to] of shades) {
      if (from && to && from < to) picture.append(drawing("rect", { x: x(Math.max(from, first)), y: 12, width: Math.max(0, x(Math.min(to, last)) - x(Math.max(from, first))), height: 196, fill: "#00000018" }));
    }
  }

  axis(picture, places, y, width, digits) {
    for (const tick of places) {
      picture.append(drawing("line", { x1: 44, x2: width - 10, y1: y(tick), y2: y(tick), stroke: "#ccc" }));
      picture.append(drawing("text", { x: 40, y: y(tick) + 4, "text-anchor": "end", "font-size": 11 }, this.page.number(tick, digits)));
    }
  }
}
