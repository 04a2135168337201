"use strict";
// The data block: deflated JSON and columns of numbers, see packing.py.

const [UNKNOWN, INFINITE, LOWEST] = [-2147483648, 2147483647, -300];

async function unpacked(text) {
  const letters = atob(text.trim());
  const bytes = new Uint8Array(letters.length);
  for (let i = 0; i < letters.length; i += 1) bytes[i] = letters.charCodeAt(i);
  const inflated = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  const buffer = await new Response(inflated).arrayBuffer();
  const length = new DataView(buffer).getUint32(0, true);
  const content = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  let at = 4 + length;
  for (const table of content.tables) at = readColumns(table, buffer, at);
  return content;
}

function readColumns(table, buffer, start) {
  let at = start;
  table.column = {};
  const places = {};
  for (const column of table.columns) {
    const size = { choice: 2, names: 2, text: 0 }[column.kind] ?? 4;
    const bytes = new Uint8Array(buffer, at, size * table.count);
    table.column[column.name] = READERS[column.kind](column, bytes, places);
    at += size * table.count;
  }
  return at;
}

// Whole numbers of four bytes: all first bytes, then all second ones, ...
function wholes(bytes) {
  const count = bytes.length / 4;
  const joined = new Uint8Array(bytes.length);
  for (let plane = 0; plane < 4; plane += 1) {
    for (let i = 0; i < count; i += 1) joined[4 * i + plane] = bytes[plane * count + i];
  }
  return new Int32Array(joined.buffer);
}

// Numbers from their places among all decimal ones of some digits
function numbers(column, bytes) {
  const first = 10 ** (column.digits - 1);
  return Float64Array.from(wholes(bytes), (place) => {
    if (place === 0) return 0;
    if (place === UNKNOWN) return NaN;
    if (place === INFINITE) return Infinity;
    const [order, sign] = [Math.abs(place) - 1, Math.sign(place)];
    const power = LOWEST + Math.floor(order / (9 * first)) - column.digits + 1;
    const whole = sign * (first + (order % (9 * first)));
    return power < 0 ? whole / 10 ** -power : whole * 10 ** power;
  });
}

const READERS = {
  number: numbers,
  chance: numbers,
  whole: (column, bytes) => Float64Array.from(wholes(bytes), (value) => (value === UNKNOWN ? NaN : value)),
  // Steps from where a place is expected: building 1 amid the pair, building 2 on the other side
  place: (column, bytes, places) => {
    const whole = wholes(bytes);
    const [middle, other] = column.before.map((name) => places[name]);
    if (middle) for (let i = 0; i < whole.length; i += 1) whole[i] += other ? 2 * middle[i] - other[i] : middle[i];
    places[column.name] = whole;
    return Float64Array.from(whole, (value) => (value === UNKNOWN ? NaN : value / 1e6));
  },
  choice: (column, bytes) => ({
    texts: column.texts,
    codes: new Uint16Array(bytes.slice().buffer),
  }),
  text: (column) => column.texts,
};
READERS.names = READERS.choice;

// Elements: texts are always set as texts, never as markup.

const RIGHT_TO_LEFT = /[\u0590-\u08ff\ufb1d-\ufdff\ufe70-\ufefc](?:[^\p{Letter}\p{Number},;]*[\u0590-\u08ff\ufb1d-\ufdff\ufe70-\ufefc])*/gu;

// Words that run from right to left stand by themselves, so that what follows them keeps its order
function isolated(text) {
  if (typeof text !== "string" || text.search(RIGHT_TO_LEFT) < 0) return [text];
  const parts = [];
  let at = 0;
  for (const found of text.matchAll(RIGHT_TO_LEFT)) {
    const word = document.createElement("bdi");
    word.textContent = found[0];
    parts.push(text.slice(at, found.index), word);
    at = found.index + found[0].length;
  }
  return [...parts, text.slice(at)];
}

function element(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...(attributes.dir ? children : children.flatMap(isolated)));
  return made;
}

function drawing(name, attributes = {}, text = null) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (text !== null) made.textContent = text;
  return made;
}

function byId(name) {
  return document.getElementById(name);
}

function say(name, text) {
  byId(name).replaceChildren(...isolated(text));
}
