// Copyright 2026 satform contributors
// SPDX-License-Identifier: Apache-2.0
"use strict";

// Draws the figures of a campaign's report from the numbers in the page.
(() => {
  const { data, config, style, numbers, axis, base, addCards, start } = page;
  // Plotly reads some tags in its texts.
  const plain = (text) => text.replaceAll("&", "&amp;").replaceAll("<", "&lt;").replaceAll(">", "&gt;");
  const short = (text) => plain(text.length > 42 ? `${text.slice(0, 26)}…${text.slice(-14)}` : text);
  const colour = (name) => style(`--${name}`);
  const faint = (name) => `color-mix(in srgb, ${colour(name)} 22%, transparent)`;

  // A filled outline of a histogram: counts between edges.
  const steps = (part) => {
    const edges = numbers(part.x);
    const counts = numbers(part.y);
    return [{
      type: "scatter", mode: "lines", name: plain(part.name), x: edges, y: [...counts, counts[counts.length - 1]],
      line: { shape: "hv", color: colour(part.colour), width: 1.4 }, fill: "tozeroy", fillcolor: faint(part.colour),
      hovertemplate: "from %{x:.5~g}: %{y} cases",
    }];
  };
  const line = (part) => [{
    type: "scatter", mode: "lines", name: plain(part.name), x: numbers(part.x), y: numbers(part.y),
    line: { color: colour(part.colour), width: 1.8, dash: part.dash || "solid" }, hovertemplate: "%{y:.5~g}",
  }];
  const band = (part) => [
    {
      type: "scatter", mode: "lines", name: "5 %", x: numbers(part.x), y: numbers(part.low), showlegend: false,
      line: { color: colour(part.colour), width: 0.8 }, hovertemplate: "%{y:.5~g}",
    },
    {
      type: "scatter", mode: "lines", name: plain(part.name), x: numbers(part.x), y: numbers(part.high),
      line: { color: colour(part.colour), width: 0.8 }, fill: "tonexty", fillcolor: faint(part.colour),
      hovertemplate: "%{y:.5~g}",
    },
  ];
  const points = (part) => [{
    type: "scatter", mode: "markers", name: plain(part.name), x: numbers(part.x), y: numbers(part.y),
    text: part.cases.map((number) => `case ${number}`), hovertemplate: "%{text}<br>%{x:.5~g}, %{y:.5~g}<extra></extra>",
    marker: { color: colour(part.colour), size: 5, opacity: 0.6 },
  }];
  const range = (part) => {
    const y = numbers(part.y);
    return [{
      type: "scatter", mode: part.names ? "markers" : "lines+markers", name: plain(part.name),
      x: part.names ? part.names.map(short) : numbers(part.x), y,
      error_y: part.low === null ? { visible: false } : {
        type: "data", symmetric: false, array: numbers(part.high).map((value, i) => value - y[i]),
        arrayminus: numbers(part.low).map((value, i) => y[i] - value), color: colour(part.colour), thickness: 1.2,
      },
      line: { color: colour(part.colour), width: 1.2 }, marker: { color: colour(part.colour), size: 6 },
      text: part.cases.map((count) => `of ${count} cases`), hovertemplate: "%{x}: %{y:.4~g} %{text}<extra></extra>",
    }];
  };
  const heat = (part) => [{
    type: "heatmap", z: part.z, x: part.columns.map(short), y: part.rows.map(short), zmin: -1, zmax: 1,
    colorscale: [[0, colour("bad")], [0.5, colour("panel")], [1, colour("accent")]], xgap: 1, ygap: 1,
    hovertemplate: "%{y}<br>%{x}<br>ρ = %{z:.3f}<extra></extra>", colorbar: { thickness: 10, outlinewidth: 0 },
    texttemplate: part.columns.length < 8 ? "%{z:.2f}" : "", hoverongaps: false,
  }];
  const kinds = { steps, line, band, points, range, heat };

  const side = (about) => ({
    ...axis(plain(about.title)),
    ...(about.log ? { type: "log", exponentformat: "power" } : about.names ? { type: "category" } : { tickformat: ",~g" }),
    ...(about.zero ? { rangemode: "tozero" } : {}),
  });

  function layout(chart) {
    const shapes = chart.limits.map((limit) => ({
      type: "line", xref: "x", yref: "paper", x0: limit.at, x1: limit.at, y0: 0, y1: 1,
      line: { color: colour("bad"), width: 1.4, dash: "dash" },
      label: { text: plain(limit.text), textposition: "end", font: { size: 10, color: colour("soft") } },
    }));
    const vertical = side(chart.y);
    if (chart.kind === "heat") vertical.autorange = "reversed";
    return {
      ...base(),
      margin: { l: 58, r: 14, t: 30, b: 40 },
      xaxis: side(chart.x),
      yaxis: vertical,
      hovermode: chart.kind === "time" ? "x unified" : "closest",
      legend: { orientation: "h", x: 0, xanchor: "left", y: 1.01, yanchor: "bottom", font: { size: 11 } },
      showlegend: chart.parts.length > 1,
      shapes,
      uirevision: chart.key,
    };
  }

  const every = Object.entries(data.charts);
  for (const [section, charts] of every) addCards(charts, section);
  for (const [, charts] of every) {
    for (const chart of charts) if (chart.height) chart.plot.style.height = `${chart.height}px`;
  }
  start(() => Promise.all(every.flatMap(([, charts]) => charts.map((chart) => Plotly.react(
    chart.plot, chart.parts.flatMap((part) => kinds[part.kind](part)), layout(chart),
    config(["toImage", "resetScale2d"]),
  )))));
})();
