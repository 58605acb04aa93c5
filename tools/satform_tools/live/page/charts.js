// Copyright 2026 satform contributors
// SPDX-License-Identifier: Apache-2.0
"use strict";

// Charts over time beside the scene, by uPlot.
const liveCharts = (() => {
  const MOST_LINES = 12;
  const height = () => (innerWidth < 1800 ? 150 : 210);
  const known = [
    { key: "error", title: "Tracking error", unit: "m", logarithmic: true },
    { key: "spread", title: "Arc-length spread", unit: "m", logarithmic: true, lone: "flown", theory: true },
    { key: "control", title: "Commanded acceleration", unit: "m/s²" },
    { key: "delta_v", title: "Delta-v", unit: "m/s" },
    { key: "connectivity", title: "Algebraic connectivity", unit: "λ₂", lone: "λ₂", steps: true },
  ];

  function create(container, { store, colour, style, clock, seek, hidden }) {
    const charts = { container, store, colour, style, clock, seek, hidden, cards: [], now: 0 };
    for (const kind of known) {
      if (kind.key === "spread" && !store.formation.agrees) continue;
      if (kind.key === "connectivity" && store.formation.names.length < 2) continue;
      charts.cards.push(card(charts, kind));
    }
    const observer = new ResizeObserver(() => {
      for (const { plot, box } of charts.cards) if (plot && box.clientWidth) plot.setSize({ width: box.clientWidth, height: height() });
    });
    charts.cards.forEach(({ box }) => observer.observe(box));
    return {
      update: () => charts.cards.forEach((one) => update(charts, one)),
      mark: (time) => mark(charts, time),
      rebuild: () => charts.cards.forEach((one) => { one.plot?.destroy(); one.plot = null; update(charts, one); }),
      destroy: () => { observer.disconnect(); container.replaceChildren(); },
      data: () => Object.fromEntries(charts.cards.map(({ kind, plot }) => [kind.key, plot ? plot.data.map((line) => line.length) : []])),
    };
  }

  function card(charts, kind) {
    const frame = document.createElement("div");
    frame.className = "figure";
    const heading = document.createElement("h3");
    heading.textContent = kind.title;
    const reading = document.createElement("span");
    heading.append(reading);
    const box = document.createElement("div");
    box.className = "chart";
    box.id = `chart-${kind.key}`;
    frame.append(heading, box);
    const { theory, delta_v_note: approximate, names } = charts.store.formation;
    const words = [
      !kind.lone && names.length > MOST_LINES ? "largest, median and smallest of all satellites" : "",
      kind.theory && theory ? "dashed: linear theory" : "",
      kind.key === "delta_v" ? approximate : "",
    ].filter(Boolean).join("; ");
    if (words) {
      const note = document.createElement("p");
      note.className = "note";
      note.textContent = words;
      frame.append(note);
    }
    charts.container.append(frame);
    return { kind, box, reading, plot: null };
  }

  // Times and lines of a chart; of many satellites the smallest, the median and the largest value.
  function lines(charts, kind) {
    const { store } = charts, count = kind.lone ? 1 : store.formation.names.length;
    const column = store.columns[kind.key];
    const times = Array.from({ length: store.rows }, (_, row) => store.time(row) / charts.clock.size);
    const drawable = (value) => (Number.isFinite(value) && !(kind.logarithmic && value <= 0) ? value : null);
    if (count <= MOST_LINES) {
      const found = Array.from({ length: count }, (_, index) =>
        Array.from({ length: store.rows }, (_, row) => drawable(column.data[row * column.width + index])));
      return [times, ...found];
    }
    const sorted = Array.from({ length: store.rows }, (_, row) =>
      [...column.data.subarray(row * column.width, (row + 1) * column.width)].filter(Number.isFinite).sort((a, b) => a - b));
    const at = (part) => sorted.map((values) => (values.length ? drawable(values[Math.round(part * (values.length - 1))]) : null));
    return [times, at(0), at(0.5), at(1)];
  }

  function withTheory(charts, kind, data) {
    const { theory } = charts.store.formation;
    if (!kind.theory || !theory) return data;
    const end = charts.store.lastTime();
    let place = 0;
    const expected = data[0].map((scaled) => {
      const time = scaled * charts.clock.size;
      while (place + 2 < theory.time.length && theory.time[place + 1] < time) place++;
      const [a, b] = [theory.time[place], theory.time[place + 1]];
      const part = Math.max(0, Math.min(1, (time - a) / (b - a)));
      const value = theory.spread[place] + part * (theory.spread[place + 1] - theory.spread[place]);
      return time <= end && value > 0 ? value : null;
    });
    return [...data, expected];
  }

  function seriesOf(charts, kind, lineCount) {
    const { names } = charts.store.formation;
    const many = !kind.lone && names.length > MOST_LINES;
    const labels = kind.lone ? [kind.lone] : many ? ["smallest", "median", "largest"] : names;
    return [{}, ...Array.from({ length: lineCount }, (_, index) => {
      const theory = kind.theory && index >= labels.length;
      return {
        label: theory ? "linear theory" : labels[index],
        stroke: () => (theory ? charts.style("--ink") : kind.lone || many ? charts.colour(index % 7, 7) : charts.colour(index, names.length)),
        dash: theory ? [6, 4] : undefined, width: 1.6, points: { show: false }, spanGaps: false,
        show: kind.lone || many || !charts.hidden.has(index),
        paths: kind.steps ? uPlot.paths.stepped({ align: 1 }) : undefined,
      };
    })];
  }

  function options(charts, kind, lineCount) {
    const axis = (more) => ({
      stroke: () => charts.style("--soft"), grid: { stroke: () => charts.style("--grid"), width: 1 }, ticks: { show: false },
      font: `11px ${getComputedStyle(document.body).fontFamily}`, ...more,
    });
    const filter = (_, ticks) => (kind.logarithmic ? ticks.map(decade) : ticks);
    const decades = { filter, grid: { filter, stroke: () => charts.style("--grid"), width: 1 } };
    return {
      width: 320, height: height(), legend: { show: false }, padding: [8, 30, 0, 0],
      cursor: { drag: { x: false, y: false }, points: { size: 5 }, y: false },
      scales: { x: { time: false }, y: kind.logarithmic ? { distr: 3 } : { range: (_, low, high) => padded(low, high) } },
      axes: [axis({ size: 30, values: (_, ticks) => ticks.map((value) => `${geometry.short(value)} ${charts.clock.name}`), space: 70 }),
        axis({ size: 56, ...decades, values: (_, ticks) => ticks.map((value) => (value === null ? "" : powers(value))) })],
      series: seriesOf(charts, kind, lineCount),
      hooks: {
        draw: [(plot) => drawMark(charts, plot)],
        ready: [(plot) => plot.over.addEventListener("click", () => {
          if (plot.cursor.left >= 0) charts.seek(plot.posToVal(plot.cursor.left, "x") * charts.clock.size);
        })],
      },
    };
  }

  function padded(low, high) {
    if (low === null || low === undefined) return [0, 1];
    const from = Math.min(0, low), to = Math.max(high, 0);
    return [from, to === from ? from + 1 : to + 0.06 * (to - from)];
  }

  const decade = (value) => (value > 0 && Math.abs(Math.log10(value) - Math.round(Math.log10(value))) < 1e-6 ? value : null);
  const powers = (value) => (value !== 0 && (Math.abs(value) >= 1e5 || Math.abs(value) < 1e-3) ? value.toExponential(0).replace("e+", "e") : geometry.short(value));

  function drawMark(charts, plot) {
    const x = plot.valToPos(charts.now / charts.clock.size, "x", true);
    if (!Number.isFinite(x)) return;
    const { ctx, bbox } = plot;
    ctx.save();
    ctx.strokeStyle = charts.style("--soft");
    ctx.lineWidth = 1;
    ctx.setLineDash([]);
    ctx.beginPath();
    ctx.moveTo(x, bbox.top);
    ctx.lineTo(x, bbox.top + bbox.height);
    ctx.stroke();
    ctx.restore();
  }

  function update(charts, one) {
    if (!charts.store.rows) return;
    const data = withTheory(charts, one.kind, lines(charts, one.kind));
    if (one.plot) one.plot.setData(data);
    else {
      one.plot = new uPlot(options(charts, one.kind, data.length - 1), data, one.box);
      if (one.box.clientWidth) one.plot.setSize({ width: one.box.clientWidth, height: height() });
    }
  }

  function mark(charts, time) {
    charts.now = time;
    const { store } = charts;
    if (!store.rows) return;
    const row = store.rowAt(time);
    for (const { plot, kind, reading } of charts.cards) {
      plot?.redraw(false, false);
      const values = [...store.values(kind.key, row)].filter(Number.isFinite);
      const largest = values.length ? Math.max(...values) : NaN;
      reading.textContent = Number.isFinite(largest) ? `${kind.lone ? "" : "largest "}${Number(largest.toPrecision(4))} ${kind.lone === "λ₂" ? "" : kind.unit}` : "";
    }
  }

  return { create };
})();
