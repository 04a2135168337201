"use strict";
// Everything about one pair: numbers in words, circles, history, prevention, flags.

class Details {
  constructor(page) {
    this.page = page;
    this.place = byId("detail");
  }

  value(name, i) {
    const values = this.page.pairs.column[name];
    if (!values) return NaN;
    return values.codes ? values.texts[values.codes[i]] : values[i];
  }

  show(i, focus) {
    const { t } = this.page;
    const close = element("button", { type: "button", class: "close" }, t("close"));
    close.addEventListener("click", () => this.page.choose(null));
    const [state, grade] = [this.page.stateOf(i), this.page.classOf(i)];
    const heading = element("h2", {}, `${t("pair")} ${this.value("pair_id", i)} `);
    const words = element("p", {}, element("strong", {}, swatch(grade), ` ${grade.label}; ${t("state")}: ${state.label}. `), this.words(i));
    const circles = this.circles(i);
    if (circles.length) circles.push(element("p", { class: "small" }, t("circles_note")));
    const pictures = element("div", { class: "pictures" }, ...circles, ...this.history(i));
    this.place.replaceChildren(
      close, heading, words, pictures, this.buildings(i),
      ...this.prevention(i), ...this.flags(i), ...this.derived(i), ...this.sensitivity(i), ...this.sides(i),
    );
    this.place.hidden = false;
    if (focus) this.place.focus();
  }

  hide() {
    this.place.hidden = true;
    this.place.replaceChildren();
  }

  centimetres(name, i) { return this.page.number(100 * this.value(name, i), 1); }

  words(i) {
    const { t, number } = this.page;
    const known = (name) => Number.isFinite(this.value(name, i));
    const said = [];
    if (known("probability")) said.push(t("says_probability", { value: this.page.percent(this.value("probability", i)) }));
    if (known("expected_impact_velocity") && this.value("expected_impact_velocity", i) > 0) {
      said.push(t(known("impact_velocity_84") ? "says_velocity" : "says_velocity_alone", {
        value: number(this.value("expected_impact_velocity", i)),
        high: number(this.value("impact_velocity_84", i)),
      }));
    }
    if (known("annual_probability")) said.push(t("says_annual", { value: number(100 * this.value("annual_probability", i)) }));
    if (known("gap_for_target")) said.push(t("says_target", { value: this.centimetres("gap_for_target", i) }));
    const gap = known("gap") ? t(this.value("gap", i) === 0 ? "says_touching" : "says_gap", { value: this.centimetres("gap", i) }) : t("says_no_gap");
    said.push(gap);
    if (known("demand")) said.push(t("says_demand", { value: this.centimetres("demand", i), rule: t(`rule_${this.value("demand_rule", i)}`) }));
    if (this.value("impacts", i) > 0) {
      said.push(t("says_impacts", { count: number(this.value("impacts", i), 0), velocity: number(this.value("impact_velocity_exact", i)) }));
    }
    if (known("expected_amplification")) said.push(t("says_amplification", { value: number(this.value("expected_amplification", i)) }));
    const station = this.value("station", i);
    const address = this.value("address", i);
    if (address && typeof address === "string") said.push(t("says_address", { value: address }));
    if (station) said.push(t("says_station", { station, value: number(this.value("distance", i) / 1000, 1) }));
    return said.join(" ");
  }

  buildings(i) {
    const { t, number } = this.page;
    const facts = [
      ["building_id", null], ["height", 1, 1], ["storeys", 1, 0], ["period", 1, 2], ["damping", 100, 1],
      ["participation", 1, 2], ["per", 100, 1], ["sd", 100, 1], ["amplification_exact", 1],
    ];
    const table = element("table", { class: "facts" }, element("caption", {}, t("both_buildings")));
    const heads = [t("building"), "1", "2"].map((text, at) => element("th", { scope: "col", class: at ? "number" : "name" }, text));
    table.append(element("tr", {}, ...heads));
    for (const [name, factor, digits] of facts) {
      if (!this.page.pairs.column[`${name}_1`]) continue;
      const cells = [1, 2].map((side) => {
        const value = this.value(`${name}_${side}`, i);
        return element("td", { class: factor ? "number" : "name" }, factor ? number(factor * value, digits) : value || "–");
      });
      table.append(element("tr", {}, element("th", { scope: "row" }, t(`fact_${name}`)), ...cells));
    }
    return element("div", { class: "scroll" }, table);
  }

  // Both circles of energy at contact height, at the gap that there is and at the gap that is needed
  circles(i) {
    const { t } = this.page;
    const radii = [1, 2].map((side) => this.value(`per_${side}`, i) * this.value(`participation_${side}`, i));
    if (!radii.every(Number.isFinite)) return [];
    const gaps = [["circles_gap", this.value("gap", i)], ["circles_needed", this.value("demand", i)]];
    return gaps.filter(([, gap]) => Number.isFinite(gap)).map(([key, gap]) => {
      const caption = t(key, { value: this.page.number(100 * gap, 1) });
      return element("figure", {}, element("figcaption", {}, caption), this.circlePicture(radii, gap, caption));
    });
  }

  circlePicture(radii, gap, caption) {
    const furthest = Math.max(this.largestGap(radii), gap);
    const width = radii[0] + furthest + radii[1];
    const height = 2.1 * Math.max(...radii);
    const scale = Math.min(340 / width, 200 / height);
    const picture = drawing("svg", { class: "picture", viewBox: "0 0 360 220", role: "img", "aria-label": caption });
    const middle = 180 - (scale * (gap + radii[1] - radii[0])) / 2;
    const centres = [middle, middle + scale * gap];
    const colours = this.page.content.building_colours;
    const dashes = ["none", "7 4"];
    [0, 1].forEach((side) => {
      picture.append(drawing("circle", {
        cx: centres[side], cy: 105, r: scale * radii[side], fill: colours[side], "fill-opacity": 0.2,
        stroke: colours[side], "stroke-width": 2, "stroke-dasharray": dashes[side],
      }));
      picture.append(drawing("line", { x1: centres[side], x2: centres[side], y1: 10, y2: 200, stroke: colours[side] }));
      const anchor = side ? "start" : "end";
      picture.append(drawing("text", { x: centres[side] + (side ? 4 : -4), y: 214, "text-anchor": anchor, "font-size": 12 }, String(side + 1)));
    });
    return picture;
  }

  largestGap(radii) { return Math.hypot(radii[0], radii[1]); }

  history(i) {
    const { t } = this.page;
    const found = this.page.content.histories[String(Math.round(this.value("rank", i)))];
    if (!found) return this.value("station", i) ? [element("p", { class: "small" }, t("no_history", { count: this.page.whole(this.page.content.history_count), command: this.command(i) }))] : [];
    const caption = t("history", { count: this.page.whole(found.impacts.length) });
    // As wide as the page, so that letters keep their size
    const width = Math.max(300, Math.min(1150, document.documentElement.clientWidth - 60));
    const picture = drawing("svg", { class: "picture", viewBox: `0 0 ${width} 240`, role: "img", "aria-label": caption });
    const start = found.time[0];
    const length = found.time[found.time.length - 1] - start || 1;
    const gap = 1000 * this.value("gap", i);
    const two = found.two.map((value) => value + gap);
    const all = [...found.one, ...two];
    const [low, high] = [Math.min(...all), Math.max(...all)];
    const x = (time) => 44 + ((width - 54) * (time - start)) / length;
    const y = (value) => 12 + (196 * (high - value)) / (high - low || 1);
    const colours = this.page.content.building_colours;
    for (const tick of ticks(low / 10, high / 10)) {
      picture.append(drawing("line", { x1: 44, x2: width - 10, y1: y(10 * tick), y2: y(10 * tick), stroke: "#ccc" }));
      picture.append(drawing("text", { x: 40, y: y(10 * tick) + 4, "text-anchor": "end", "font-size": 11 }, this.page.number(tick, tickDigits(low / 10, high / 10))));
    }
    for (const tick of ticks(start, start + length)) {
      picture.append(drawing("text", { x: x(tick), y: 224, "text-anchor": "middle", "font-size": 11 }, `${this.page.number(tick, tickDigits(start, start + length))} s`));
    }
    [found.one, two].forEach((line, side) => {
      const points = line.map((value, at) => {
        const step = Math.floor(at / 2);
        const time = found.time[step] + ((at % 2) / 2) * (found.time[step + 1] - found.time[step]);
        return `${x(time).toFixed(1)},${y(value).toFixed(1)}`;
      });
      picture.append(drawing("polyline", { points: points.join(" "), fill: "none", stroke: colours[side], "stroke-width": 1.3, "stroke-dasharray": side ? "5 2" : "none" }));
    });
    const fastest = Math.max(...found.impacts.map(([, speed]) => speed), 1e-9);
    for (const [time, speed] of found.impacts) {
      if (time < start || time > start + length) continue;
      picture.append(drawing("line", { x1: x(time), x2: x(time), y1: 208, y2: 208 - Math.max(4, (34 * speed) / fastest), stroke: "#000", "stroke-width": 1 }));
    }
    const notes = [element("p", { class: "small" }, t("history_note"))];
    // The drawn inputs are the likeliest ones; others may hit
    if (!found.impacts.length && this.value("probability", i) > 0) notes.push(element("p", { class: "small" }, t("history_apart")));
    return [element("figure", { class: "wide" }, element("figcaption", {}, caption), picture, ...notes)];
  }

  // The command that draws a pair of which the page holds no history; a rank needs no quotation
  command(i) { return `per-obspy show "#${Math.round(this.value("rank", i))}" . -o pair.png`; }

  prevention(i) {
    const { t, number } = this.page;
    const said = [];
    const [missing, damping, bumper] = ["missing_gap", "supplemental_damping", "bumper_restitution"].map((name) => this.value(name, i));
    // The case is decided where the page is written, see words.prevention_kind
    const kind = this.value("prevention_kind", i);
    const values = { gap: this.centimetres("gap", i), whole: this.centimetres("demand", i), name: this.value("worst_scenario", i) };
    if (kind !== "gap") said.push(t(`prevents_${kind}`, values));
    else {
      said.push(t("prevents_gap", { value: number(100 * missing, 1), whole: values.whole }));
      if (!this.value("station", i)) said.push(t("prevents_without_record"));
      else if (damping > 0) said.push(t("prevents_damping", { value: number(100 * damping, 0) }));
      else said.push(t("prevents_no_damping"));
      if (bumper < 1) said.push(t("prevents_bumper", { value: number(bumper, 2) }));
    }
    return [element("h3", {}, t("prevention")), element("ul", {}, ...said.map((text) => element("li", {}, text)))];
  }

  flags(i) {
    const names = String(this.value("flags", i) || "").split(" ").filter(Boolean);
    if (!names.length) return [];
    const list = element("dl", {});
    for (const name of names) {
      list.append(element("dt", {}, this.page.flagName(name)), element("dd", {}, this.page.content.flags[name] || "–"));
    }
    return [element("h3", {}, this.page.t("flags")), list];
  }

  derived(i) {
    const { t, number } = this.page;
    const names = String(this.value("derived", i) || "").split(" ").filter(Boolean);
    if (!names.length) return [];
    const made = [element("h3", {}, t("derived")), element("p", {}, names.map((name) => this.page.inputName(name)).join(", "))];
    const spread = [1, 2].map((side) => this.value(`period_log_std_${side}`, i));
    const sure = spread.every((value) => value > 0);
    if (sure) made.push(element("p", {}, t("derived_spread", { first: number(100 * spread[0], 0), second: number(100 * spread[1], 0) })));
    else made.push(element("p", {}, t("derived_fixed")));
    return made;
  }

  // Probability and state at other values of each uncertain input
  sensitivity(i) {
    const { t, content } = this.page;
    const rows = (content.sensitivity || {})[String(Math.round(this.value("rank", i)))];
    const [worst, doubtful] = content.sensitivity_counts || [0, 0];
    const derived = String(this.value("derived", i) || "").split(" ").filter(Boolean);
    const made = [element("h3", {}, t("sensitivity"))];
    if (!rows) {
      if (!derived.length || !worst) return [];
      // One of the worst pairs without rows has no input with a deviation
      if (this.value("rank", i) <= worst) return this.fixedInputs(derived, []);
      return [...made, element("p", { class: "small" }, t("sensitivity_none", { worst: String(worst), doubtful: String(doubtful) }))];
    }
    const heads = ["column_input", "column_low", "column_then", "column_high", "column_then"];
    const table = element("table", {}, element("tr", {}, ...heads.map((key) => element("th", { scope: "col" }, t(key)))));
    for (const [name, low, high, chanceLow, chanceHigh, stateLow, stateHigh] of rows) {
      const then = (chance, state) => element("td", {}, t("chance_and_state", { chance: this.page.percent(chance), state: this.stateLabel(state) }));
      table.append(element("tr", {}, element("th", { scope: "row" }, this.page.inputName(name)), element("td", {}, this.inputText(name, low)), then(chanceLow, stateLow), element("td", {}, this.inputText(name, high)), then(chanceHigh, stateHigh)));
    }
    return [...made, element("div", { class: "scroll" }, table), element("p", { class: "small" }, t("sensitivity_note")), ...this.fixedInputs(derived, rows)];
  }

  // Derived inputs that have no deviation: the probability takes them as exact
  fixedInputs(derived, rows) {
    const varied = new Set(rows.map(([name]) => name));
    const fixed = derived.filter((name) => !varied.has(name) && name !== "gap_std");
    if (!fixed.length) return [];
    return [element("p", { class: "small" }, this.page.t("sensitivity_fixed", { names: fixed.map((name) => this.page.inputName(name)).join(", ") }))];
  }

  stateLabel(name) {
    const found = this.page.content.states.find((state) => state.name === name);
    return found ? found.label : name;
  }

  inputText(name, value) {
    const { number } = this.page;
    if (name === "period_correlation") return number(value, 2);
    if (name.startsWith("period")) return `${number(value, 2)} s`;
    if (name.startsWith("damping")) return `${number(100 * value, 1)} %`;
    return `${number(100 * value, 1)} cm`;
  }

  // Other pairs of both buildings
  sides(i) {
    const { t } = this.page;
    const made = [];
    for (const side of [1, 2]) {
      const name = this.value(`building_id_${side}`, i);
      if (!name || typeof name !== "string") continue;
      const facts = this.page.buildingFacts(name);
      const others = (this.page.pairsOf.get(name) || []).filter((pair) => pair !== i).slice(0, 12);
      if (!others.length && !facts) continue;
      made.push(element("h3", {}, `${t("building")} ${name}`));
      if (facts) made.push(element("p", {}, facts));
      if (!others.length) continue;
      const list = element("p", {}, `${t("other_pairs")} `);
      for (const pair of others) {
        const button = element("button", { type: "button" }, this.value("pair_id", pair));
        button.addEventListener("click", () => this.page.choose(pair, true));
        list.append(button, " ");
      }
      made.push(list);
    }
    return made;
  }
}

function tickStep(low, high) {
  const rough = (high - low) / 4 || 1;
  const power = 10 ** Math.floor(Math.log10(rough));
  return [1, 2, 5, 10].map((digit) => digit * power).find((step) => step >= rough);
}

function tickDigits(low, high) {
  return Math.max(0, -Math.floor(Math.log10(tickStep(low, high)) + 1e-9));
}

function ticks(low, high) {
  const step = tickStep(low, high);
  const found = [];
  for (let tick = Math.ceil(low / step) * step; tick <= high; tick += step) found.push(tick);
  return found;
}
