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
  for (const column of table.columns) {
    const size = ({ choice: 2, names: 2, text: 0 }[column.kind] ?? 4) * table.count;
    column.bytes = new Uint8Array(buffer, at, size);
    at += size;
    // Read when it is used first: most columns are of the details of a pair
    const get = () => {
      const value = READERS[column.kind](column, table);
      Object.defineProperty(table.column, column.name, { value });
      return value;
    };
    Object.defineProperty(table.column, column.name, { get, enumerable: true, configurable: true });
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
function numbers(column) {
  const places = wholes(column.bytes);
  const first = 10 ** (column.digits - 1);
  const found = new Float64Array(places.length);
  for (let i = 0; i < places.length; i += 1) {
    const order = Math.abs(places[i]) - 1;
    const power = LOWEST + Math.floor(order / (9 * first)) - column.digits + 1;
    const whole = Math.sign(places[i]) * (first + (order % (9 * first)));
    found[i] = power < 0 ? whole / 10 ** -power : whole * 10 ** power;
    if (places[i] === UNKNOWN) found[i] = NaN;
    if (places[i] === INFINITE) found[i] = Infinity;
  }
  return found;
}

// Whole numbers of a unit, of which so many are 1
function units(whole, unit) {
  const found = new Float64Array(whole.length);
  for (let i = 0; i < whole.length; i += 1) found[i] = whole[i] === UNKNOWN ? NaN : whole[i] / unit;
  return found;
}

// Steps from where a place is expected: building 1 amid the pair, building 2 on the other side
function wholePlaces(column, table) {
  const whole = wholes(column.bytes);
  const [middle, other] = column.before.map((name) => wholePlaces(table.columns.find((one) => one.name === name), table));
  if (middle) for (let i = 0; i < whole.length; i += 1) whole[i] += other ? 2 * middle[i] - other[i] : middle[i];
  return whole;
}

const READERS = {
  number: numbers,
  chance: numbers,
  whole: (column) => units(wholes(column.bytes), 1),
  place: (column, table) => units(wholePlaces(column, table), 1e6),
  choice: (column) => ({ texts: column.texts, codes: new Uint16Array(column.bytes.slice().buffer) }),
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
