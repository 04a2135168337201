"use strict";
// The map: pairs as lines or outlines on a canvas, to be moved and enlarged.

const MARK = 5; // pixels: a pair whose line would be shorter is a square
const COARSE = 12000; // pixels per degree up to which coast lines are drawn: 1 pixel is 9 m
const PICK = 9; // pixels: how near a click must be
const MOST_TOWNS = 12; // names of towns at a time
const STEP = 1e-5; // degrees: a step of the background

class PairMap {
  constructor(canvas, page) {
    this.canvas = canvas;
    this.page = page;
    this.background = (page.content.background || []).map(unfolded);
    this.listeners();
    this.order = null;
    this.fit();
  }

  // Degrees -> degrees of latitude from the middle, and to pixels
  setPlaces() {
    const { longitude, latitude, longitude_1: x1, latitude_1: y1, longitude_2: x2, latitude_2: y2 } =
      this.page.pairs.column;
    const count = this.page.pairs.count;
    this.ends = new Float64Array(4 * count);
    for (let i = 0; i < count; i += 1) {
      const known = x1 && Number.isFinite(x1[i] + y1[i] + x2[i] + y2[i]);
      this.ends[4 * i] = known ? x1[i] : longitude[i];
      this.ends[4 * i + 1] = known ? y1[i] : latitude[i];
      this.ends[4 * i + 2] = known ? x2[i] : longitude[i];
      this.ends[4 * i + 3] = known ? y2[i] : latitude[i];
    }
  }

  fit() {
    if (!this.ends) this.setPlaces();
    const box = [Infinity, Infinity, -Infinity, -Infinity];
    let first = null;
    const include = (longitude, y) => {
      if (!Number.isFinite(longitude + y)) return;
      // Places on both sides of the date line are neighbours
      if (first === null) first = longitude;
      const x = first + aroundZero(longitude - first);
      box[0] = Math.min(box[0], x); box[1] = Math.min(box[1], y);
      box[2] = Math.max(box[2], x); box[3] = Math.max(box[3], y);
    };
    for (let i = 0; i < this.ends.length; i += 2) include(this.ends[i], this.ends[i + 1]);
    const cells = this.page.cells;
    for (let i = 0; i < cells.count; i += 1) include(cells.column.longitude[i], cells.column.latitude[i]);
    if (!Number.isFinite(box[0])) {
      for (const station of this.page.content.stations.places) include(station[1], station[2]);
    }
    if (!Number.isFinite(box[0])) box.splice(0, 4, -0.5, -0.5, 0.5, 0.5);
    this.centre = [(box[0] + box[2]) / 2, (box[1] + box[3]) / 2];
    this.shrink = Math.max(0.01, Math.cos((this.centre[1] * Math.PI) / 180));
    const width = Math.max((box[2] - box[0]) * this.shrink, 5e-4);
    const height = Math.max(box[3] - box[1], 5e-4);
    const { clientWidth, clientHeight } = this.canvas;
    this.scale = 0.88 * Math.min((clientWidth || 600) / width, (clientHeight || 400) / height);
    this.draw();
  }

  show(longitude, latitude, metres) {
    this.centre = [longitude, latitude];
    if (metres) this.scale = Math.max(this.scale, (0.4 * this.canvas.clientHeight) / (metres / 111200));
    this.draw();
  }

  x(longitude) { return this.width / 2 + aroundZero(longitude - this.centre[0]) * this.shrink * this.scale; }
  y(latitude) { return this.height / 2 - (latitude - this.centre[1]) * this.scale; }
  place(x, y) {
    return [
      aroundZero(this.centre[0] + (x - this.width / 2) / (this.shrink * this.scale)),
      this.centre[1] - (y - this.height / 2) / this.scale,
    ];
  }

  later() {
    if (this.waiting) return;
    this.waiting = requestAnimationFrame(() => { this.waiting = 0; this.draw(); });
  }

  draw() {
    const ratio = window.devicePixelRatio || 1;
    this.width = this.canvas.clientWidth;
    this.height = this.canvas.clientHeight;
    this.canvas.width = Math.round(this.width * ratio);
    this.canvas.height = Math.round(this.height * ratio);
    const pen = this.canvas.getContext("2d");
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.lineCap = "round";
    this.labels = [];
    this.drawLines(pen, this.background, "#a9aca6", 0.9);
    // Coast lines are right to some hundred metres: none where that would mislead
    if (this.scale < COARSE) {
      this.drawLines(pen, this.page.content.coast, "#51708a", 1.2);
      this.drawLines(pen, this.page.content.borders, "#8a6f86", 1.2, [6, 4]);
    }
    this.drawCells(pen);
    this.drawOutlines(pen);
    this.drawStations(pen);
    this.drawPairs(pen);
    this.drawTowns(pen);
    this.drawEpicentre(pen);
    this.drawScale(pen);
  }

  drawLines(pen, lines, colour, width, dash = []) {
    pen.strokeStyle = colour;
    pen.lineWidth = width;
    pen.setLineDash(dash);
    pen.beginPath();
    // A step around the world is none
    const half = 180 * this.shrink * this.scale;
    for (const line of lines || []) {
      let before = Infinity;
      for (let i = 0; i < line.length; i += 2) {
        const x = this.x(line[i]);
        if (Math.abs(x - before) < half) pen.lineTo(x, this.y(line[i + 1]));
        else pen.moveTo(x, this.y(line[i + 1]));
        before = x;
      }
    }
    pen.stroke();
    pen.setLineDash([]);
  }

  drawCells(pen) {
    const { column, count } = this.page.cells;
    if (!count || !this.page.showsCells) return;
    const side = this.page.content.cell_size;
    const { classes, states } = this.page.content;
    // Columns of each class that the filters of class and state let pass
    const passing = classes.map((_, code) => (this.page.shownClasses[code]
      ? states.map((__, state) => (this.page.shownStates[state] ? column[`${code} ${state}`] : null)).filter(Boolean) : []));
    for (let i = 0; i < count; i += 1) {
      // A cell has the colour of the worst class in it, fainter where it has few such pairs
      let [worst, sum] = [-1, 0];
      for (let code = 0; code < passing.length && !sum; code += 1) {
        for (const counts of passing[code]) sum += counts[i];
        worst = code;
      }
      if (!sum) continue;
      const left = this.x(column.longitude[i] - side / 2);
      const top = this.y(column.latitude[i] + side / 2);
      pen.globalAlpha = Math.min(0.75, 0.25 + 0.12 * Math.log10(1 + sum));
      pen.fillStyle = classes[worst].colour;
      pen.fillRect(left, top, Math.max(2, side * this.shrink * this.scale), Math.max(2, side * this.scale));
    }
    pen.globalAlpha = 1;
  }

  // Outlines are drawn from about 1 pixel per 5 m on
  hasOutlines() { return this.page.outlines.length > 0 && this.scale > 20000; }

  drawOutlines(pen) {
    if (!this.hasOutlines()) return;
    const shapes = this.page.outlines;
    pen.lineWidth = 0.8;
    pen.strokeStyle = "#555";
    for (const shape of shapes) {
      pen.beginPath();
      for (let i = 0; i < shape.ring.length; i += 2) {
        if (i) pen.lineTo(this.x(shape.ring[i]), this.y(shape.ring[i + 1]));
        else pen.moveTo(this.x(shape.ring[0]), this.y(shape.ring[1]));
      }
      pen.closePath();
      const worst = shape.pairs.find((pair) => this.page.isShown[pair]);
      pen.globalAlpha = worst === undefined ? 1 : 0.65;
      pen.fillStyle = worst === undefined ? "#fff" : this.page.colourOf(worst);
      pen.fill();
      pen.globalAlpha = 1;
      pen.stroke();
    }
  }

  drawPairs(pen) {
    const { classes } = this.page.content;
    const codes = this.page.classCodes;
    const groups = classes.map(() => []);
    for (let i = 0; i < codes.length; i += 1) if (this.page.isShown[i]) groups[codes[i]].push(i);
    // The mildest first, so that the worst lies on top
    for (let code = classes.length - 1; code >= 0; code -= 1) {
      const path = new Path2D();
      const marks = new Path2D();
      const half = MARK / 2 + (code === 0 ? 0.5 : 0);
      for (const i of groups[code]) {
        const [x1, y1] = [this.x(this.ends[4 * i]), this.y(this.ends[4 * i + 1])];
        const [x2, y2] = [this.x(this.ends[4 * i + 2]), this.y(this.ends[4 * i + 3])];
        if (Math.max(x1, x2) < -9 || Math.min(x1, x2) > this.width + 9) continue;
        if (Math.max(y1, y2) < -9 || Math.min(y1, y2) > this.height + 9) continue;
        if (Math.abs(x2 - x1) + Math.abs(y2 - y1) < MARK) {
          marks.rect((x1 + x2) / 2 - half, (y1 + y2) / 2 - half, 2 * half, 2 * half);
        } else {
          path.moveTo(x1, y1);
          path.lineTo(x2, y2);
        }
      }
      // Thin between outlines, which have the colours themselves
      const width = (2.5 + 0.5 * classes[code].weight) * (this.hasOutlines() ? 0.5 : 1);
      // A dark edge keeps pale colours visible
      pen.strokeStyle = "#333";
      pen.lineWidth = width + 1.6;
      pen.stroke(path);
      pen.lineWidth = 1;
      pen.stroke(marks);
      pen.strokeStyle = pen.fillStyle = classes[code].colour;
      pen.lineWidth = width;
      pen.stroke(path);
      pen.fill(marks);
    }
    this.drawChosen(pen);
  }

  drawChosen(pen) {
    const i = this.page.chosen;
    if (i === null) return;
    const x = (this.x(this.ends[4 * i]) + this.x(this.ends[4 * i + 2])) / 2;
    const y = (this.y(this.ends[4 * i + 1]) + this.y(this.ends[4 * i + 3])) / 2;
    pen.strokeStyle = "#000";
    pen.lineWidth = 2.5;
    pen.beginPath();
    pen.arc(x, y, 14, 0, 2 * Math.PI);
    pen.stroke();
  }

  drawStations(pen) {
    pen.strokeStyle = "#222";
    pen.lineWidth = 1.3;
    pen.font = "11px sans-serif";
    pen.fillStyle = "#222";
    const places = this.page.content.stations.places;
    // Names of many stations would hide the pairs' places
    const seen = places.filter(([, x, y]) => Math.abs(this.x(x) - this.width / 2) < this.width / 2 && Math.abs(this.y(y) - this.height / 2) < this.height / 2);
    const named = seen.length <= 12;
    for (const [name, longitude, latitude, used, peak] of places) {
      const [x, y] = [this.x(longitude), this.y(latitude)];
      // As large as the ground shook there
      const size = 0.6 + Math.min(1.4, 1.6 * Math.sqrt(peak || 0));
      pen.setLineDash(used ? [] : [2, 2]);
      pen.beginPath();
      pen.moveTo(x, y - 6 * size); pen.lineTo(x + 5.5 * size, y + 4 * size); pen.lineTo(x - 5.5 * size, y + 4 * size);
      pen.closePath();
      pen.stroke();
      const amplitude = peak ? ` ${this.page.number(peak, 2)} g` : "";
      const [text, right] = [isolatedName(name) + amplitude, x + 3 + 6 * size];
      if (named && this.hasRoom(pen, text, right, y + 4)) pen.fillText(text, right, y + 4);
    }
    pen.setLineDash([]);
  }

  // Whether a text touches no earlier one, whose place it then takes
  hasRoom(pen, text, x, y) {
    const box = [x, y - 10, x + pen.measureText(text).width, y + 4];
    if (this.labels.some((other) => box[0] < other[2] && other[0] < box[2] && box[1] < other[3] && other[1] < box[3])) return false;
    this.labels.push(box);
    return true;
  }

  // Names of the largest towns that are seen, as far as there is room
  drawTowns(pen) {
    pen.font = "italic 12px sans-serif";
    pen.strokeStyle = "#ffffffd0";
    pen.lineJoin = "round";
    let count = 0;
    for (const [name, longitude, latitude] of this.page.content.towns || []) {
      const [x, y, text] = [this.x(longitude), this.y(latitude), isolatedName(name)];
      // Beside the buttons, above the scale
      const fits = x > 60 && x + pen.measureText(text).width + 8 < this.width && y > 12 && y < this.height - 40;
      if (count === MOST_TOWNS || !fits || !this.hasRoom(pen, text, x + 6, y - 4)) continue;
      // White around the letters: pairs are below
      pen.lineWidth = 3;
      pen.strokeText(text, x + 6, y - 4);
      pen.fillStyle = "#1f3a4d";
      pen.fillText(text, x + 6, y - 4);
      pen.fillRect(x - 1.5, y - 1.5, 3, 3);
      count += 1;
    }
  }

  // Pixels of the epicentre, at the edge of the map where it is further away; far off without one
  epicentre() {
    const place = this.page.content.epicentre;
    if (!place) return [Infinity, Infinity];
    return [Math.min(Math.max(this.x(place[0]), 14), this.width - 14), Math.min(Math.max(this.y(place[1]), 14), this.height - 14)];
  }

  drawEpicentre(pen) {
    const place = this.page.content.epicentre;
    if (!place) return;
    const [x, y] = this.epicentre();
    const inside = x === this.x(place[0]) && y === this.y(place[1]);
    pen.beginPath();
    for (let i = 0; i < 10; i += 1) {
      const radius = i % 2 ? 4 : 10;
      const angle = (i * Math.PI) / 5;
      pen.lineTo(x + radius * Math.sin(angle), y - radius * Math.cos(angle));
    }
    pen.closePath();
    pen.lineWidth = 1.6;
    pen.strokeStyle = "#000";
    pen.setLineDash(inside ? [] : [2, 2]);
    pen.stroke();
    pen.setLineDash([]);
  }

  drawScale(pen) {
    const metres = (110 / this.scale) * 111200;
    const power = 10 ** Math.floor(Math.log10(metres));
    const length = [5, 2, 1].map((digit) => digit * power).find((candidate) => candidate <= metres);
    const width = (length / 111200) * this.scale;
    const [[left, top], y] = [this.epicentre(), this.height - 14];
    // On the right where the epicentre is on the left
    const x = left < width + 30 && top > y - 34 ? this.width - width - 12 : 12;
    pen.fillStyle = "#ffffffcc";
    pen.fillRect(x - 6, y - 20, width + 12, 28);
    pen.strokeStyle = pen.fillStyle = "#000";
    pen.lineWidth = 2;
    pen.lineCap = "butt";
    pen.beginPath();
    pen.moveTo(x, y - 5); pen.lineTo(x, y); pen.lineTo(x + width, y); pen.lineTo(x + width, y - 5);
    pen.stroke();
    pen.font = "12px sans-serif";
    pen.fillText(length >= 1000 ? `${length / 1000} km` : `${length} m`, x + 4, y - 6);
  }

  // The shown pair nearest to a pixel, or a pair of the outline there; null if none is near
  pairAt(x, y) {
    let [nearest, best] = [null, PICK];
    for (let i = 0; i < this.page.pairs.count; i += 1) {
      if (!this.page.isShown[i]) continue;
      const [ax, ay] = [this.x(this.ends[4 * i]), this.y(this.ends[4 * i + 1])];
      const [bx, by] = [this.x(this.ends[4 * i + 2]) - ax, this.y(this.ends[4 * i + 3]) - ay];
      const along = bx * bx + by * by;
      const share = along ? Math.min(1, Math.max(0, ((x - ax) * bx + (y - ay) * by) / along)) : 0;
      const distance = Math.hypot(ax + share * bx - x, ay + share * by - y);
      if (distance < best) [nearest, best] = [i, distance];
    }
    if (nearest !== null || !this.hasOutlines()) return nearest;
    const [longitude, latitude] = this.place(x, y);
    const shape = this.page.outlines.find((candidate) => contains(candidate.ring, longitude, latitude));
    const pair = shape && shape.pairs.find((candidate) => this.page.isShown[candidate]);
    return pair === undefined ? null : pair;
  }

  zoom(factor, x = this.width / 2, y = this.height / 2) {
    const [longitude, latitude] = this.place(x, y);
    this.scale = Math.min(5e7, Math.max(1, this.scale * factor));
    this.centre[0] = longitude - (x - this.width / 2) / (this.shrink * this.scale);
    this.centre[1] = latitude + (y - this.height / 2) / this.scale;
    this.later();
  }

  move(x, y) {
    this.centre[0] -= x / (this.shrink * this.scale);
    this.centre[1] += y / this.scale;
    this.later();
  }

  listeners() {
    const { canvas } = this;
    const touches = new Map();
    let moved = 0;
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      touches.set(event.pointerId, [event.offsetX, event.offsetY]);
      moved = 0;
    });
    canvas.addEventListener("pointermove", (event) => {
      const before = touches.get(event.pointerId);
      if (!before) {
        this.point(event);
        return;
      }
      const other = [...touches].find(([id]) => id !== event.pointerId);
      const now = [event.offsetX, event.offsetY];
      moved += Math.abs(now[0] - before[0]) + Math.abs(now[1] - before[1]);
      if (other) {
        const apart = (place) => Math.hypot(place[0] - other[1][0], place[1] - other[1][1]) || 1;
        this.zoom(apart(now) / apart(before), other[1][0], other[1][1]);
      } else if (moved > 3) this.move(now[0] - before[0], now[1] - before[1]);
      touches.set(event.pointerId, now);
    });
    const ended = (event) => {
      const wasAlone = touches.size === 1 && touches.delete(event.pointerId);
      touches.delete(event.pointerId);
      if (!wasAlone || moved > 3 || event.type !== "pointerup") return;
      const pair = this.pairAt(event.offsetX, event.offsetY);
      if (pair !== null) this.page.choose(pair);
      else this.page.stations.chooseAt(event.offsetX, event.offsetY);
    };
    canvas.addEventListener("pointerup", ended);
    canvas.addEventListener("pointercancel", ended);
    canvas.addEventListener("wheel", (event) => {
      // Only with a key, or when the map has the focus: a page must scroll
      if (!event.ctrlKey && document.activeElement !== canvas) return;
      event.preventDefault();
      this.zoom(Math.exp(-0.0015 * event.deltaY), event.offsetX, event.offsetY);
    }, { passive: false });
    canvas.addEventListener("keydown", (event) => this.key(event));
    byId("nearer").addEventListener("click", () => this.zoom(1.6));
    byId("further").addEventListener("click", () => this.zoom(1 / 1.6));
    byId("whole").addEventListener("click", () => this.fit());
    new ResizeObserver(() => this.later()).observe(canvas);
    window.addEventListener("beforeprint", () => this.draw());
  }

  point(event) {
    if (this.page.pairs.count > 5000 && event.timeStamp - (this.pointedAt || 0) < 60) return;
    this.pointedAt = event.timeStamp;
    const pair = this.pairAt(event.offsetX, event.offsetY);
    byId("pointed").textContent = pair === null ? "" : this.page.shortText(pair);
    this.canvas.style.cursor = pair === null ? "grab" : "pointer";
  }

  key(event) {
    const step = 60;
    const actions = {
      ArrowLeft: () => this.move(step, 0),
      ArrowRight: () => this.move(-step, 0),
      ArrowUp: () => this.move(0, step),
      ArrowDown: () => this.move(0, -step),
      "+": () => this.zoom(1.6),
      "=": () => this.zoom(1.6),
      "-": () => this.zoom(1 / 1.6),
      Home: () => this.fit(),
    };
    if (!actions[event.key] || event.ctrlKey || event.metaKey) return;
    event.preventDefault();
    actions[event.key]();
  }
}

// Degrees within half a turn of zero
function aroundZero(degrees) {
  return degrees - 360 * Math.round(degrees / 360);
}

// A line of steps as longitude and latitude by turns
function unfolded(steps) {
  const line = new Float64Array(steps.length);
  for (let i = 0; i < steps.length; i += 1) line[i] = STEP * steps[i] + (i > 1 ? line[i - 2] : 0);
  return line;
}

// A name on a canvas, whose direction does not change what follows it
function isolatedName(name) {
  return name.search(RIGHT_TO_LEFT) < 0 ? name : `\u2068${name}\u2069`;
}

function contains(ring, x, y) {
  let inside = false;
  for (let i = 0, j = ring.length - 2; i < ring.length; j = i, i += 2) {
    const crosses = ring[i + 1] > y !== ring[j + 1] > y;
    if (crosses && x < ((ring[j] - ring[i]) * (y - ring[i + 1])) / (ring[j + 1] - ring[i + 1]) + ring[i]) {
      inside = !inside;
    }
  }
  return inside;
}
