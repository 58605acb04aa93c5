// Copyright 2026 satform contributors
// SPDX-License-Identifier: Apache-2.0
"use strict";

// What the page has received: columns of numbers by time, of a bounded number of rows, events and graphs.
const liveStore = (() => {
  const MOST_EVENTS = 500;
  const MOST_GRAPHS = 2000;
  const DOUBLE = new Set(["time", "chief"]);
  const NOTHING = new Float32Array(0);

  function unpack(text, name) {
    const raw = atob(text);
    const bytes = new Uint8Array(raw.length);
    for (let k = 0; k < raw.length; k++) bytes[k] = raw.charCodeAt(k);
    return new (DOUBLE.has(name) ? Float64Array : Float32Array)(bytes.buffer);
  }

  function create() {
    const store = { formation: null, rows: 0, columns: {}, events: [], graphs: [], status: {} };
    return Object.assign(store, {
      begin: (formation) => begin(store, formation),
      take: (news) => take(store, news),
      time: (row) => store.columns.time.data[row],
      values: (name, row) => {
        const column = store.columns[name];
        return !column ? NOTHING : column.data.subarray(row * column.width, (row + 1) * column.width);
      },
      lastTime: () => (store.rows ? store.columns.time.data[store.rows - 1] : 0),
      rowAt: (time) => rowAt(store, time),
      graphAt: (time) => graphAt(store, time),
    });
  }

  function begin(store, formation) {
    Object.assign(store, { formation, rows: 0, columns: {}, events: [], graphs: [], status: {} });
    const packed = (text, name) => (text ? unpack(text, name) : null);
    formation.orbits = formation.orbits.map((orbit) => packed(orbit));
    formation.chiefOrbit = packed(formation.chief_orbit);
    formation.edgeIndex = new Map(formation.edges.map((edge, index) => [edge.join(), index]));
    if (formation.theory) formation.theory = { time: unpack(formation.theory.time, "time"), spread: unpack(formation.theory.spread) };
  }

  function take(store, { rows, events = [], graphs = [], status }) {
    if (rows) append(store, rows);
    store.events = [...store.events, ...events].slice(-MOST_EVENTS);
    store.graphs = [...store.graphs, ...graphs].slice(-MOST_GRAPHS);
    if (status) store.status = status;
  }

  function append(store, { count, columns }) {
    for (const [name, text] of Object.entries(columns)) {
      const news = unpack(text, name), width = news.length / count;
      const column = store.columns[name] ||= { width, data: new news.constructor(256 * width) };
      const wanted = (store.rows + count) * width;
      if (wanted > column.data.length) {
        const larger = new news.constructor(Math.max(wanted, 2 * column.data.length));
        larger.set(column.data.subarray(0, store.rows * width));
        column.data = larger;
      }
      column.data.set(news, store.rows * width);
    }
    store.rows += count;
    if (store.rows > store.formation.most_rows) thin(store);
  }

  // Every second row but of the newest tenth is left out.
  function thin(store) {
    const recent = Math.floor(0.9 * store.rows);
    const kept = [...Array(store.rows).keys()].filter((row) => row >= recent || row % 2 === 0);
    for (const column of Object.values(store.columns)) {
      kept.forEach((row, place) => column.data.copyWithin(place * column.width, row * column.width, (row + 1) * column.width));
    }
    store.rows = kept.length;
  }

  function rowAt(store, time) {
    let low = 0, high = store.rows - 1;
    while (low < high) {
      const middle = Math.ceil((low + high) / 2);
      if (store.time(middle) <= time + 1e-9) low = middle;
      else high = middle - 1;
    }
    return Math.max(0, low);
  }

  function graphAt(store, time) {
    let found = store.graphs[0] || { alive: [], pairs: [] };
    for (const graph of store.graphs) if (graph.time <= time + 1e-9) found = graph;
    return found;
  }

  return { create };
})();
