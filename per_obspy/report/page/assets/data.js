"use strict";
// The data block: deflated JSON and columns of numbers, see packing.py.

const UNKNOWN_PLACE = -2147483648;

async function unpacked(text) {
  const letters = atob(text.trim());
  const bytes = new Uint8Array(letters.length);
  for (let i = 0; i < letters.length; i += 1) bytes[i] = letters.charCodeAt(i);
  const inflated = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  const buffer = await new Response(inflated).arrayBuffer();
  const length = new DataView(buffer).getUint32(0, true);
  const content = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  let at = 4 + length;
  // Columns of the export are read when they are exported
  const [shown, stored] = [content.tables.slice(0, 3), content.tables[3]];
  for (const table of shown) at = readColumns(table, buffer, at);
  if (stored) content.stored = () => { if (!stored.column) readColumns(stored, buffer, at); return stored; };
  return content;
}

function readColumns(table, buffer, start) {
  let at = start;
  table.column = {};
  for (const column of table.columns) {
    const size = { number: 4, whole: 4, place: 4, choice: 2, names: 2, text: 0 }[column.kind] * table.count;
    const bytes = new Uint8Array(buffer, at, size);
    table.column[column.name] = READERS[column.kind](column, bytes, table.count);
    at += size;
  }
  return at;
}

function joinedPlanes(bytes, count) {
  const joined = new Uint8Array(4 * count);
  for (let plane = 0; plane < 4; plane += 1) {
    for (let i = 0; i < count; i += 1) joined[4 * i + plane] = bytes[plane * count + i];
  }
  return joined.buffer;
}

const READERS = {
  number: (column, bytes, count) => new Float32Array(joinedPlanes(bytes, count)),
  whole: (column, bytes, count) => {
    const whole = new Int32Array(joinedPlanes(bytes, count));
    return Float64Array.from(whole, (value) => (value === UNKNOWN_PLACE ? NaN : value));
  },
  place: (column, bytes, count) => {
    const whole = new Int32Array(joinedPlanes(bytes, count));
    return Float64Array.from(whole, (value) => (value === UNKNOWN_PLACE ? NaN : value / 1e6));
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
