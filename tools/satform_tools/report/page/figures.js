// Copyright 2026 satform contributors
// SPDX-License-Identifier: Apache-2.0
"use strict";

// What the scripts of all pages share: numbers of the page, colours, axes, the plotting script.
const page = (() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const element = (id) => document.getElementById(id);
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const config = (buttons) => ({ responsive: true, displaylogo: false, modeBarButtons: [buttons] });
  // Distinguishable with any colour vision (Okabe & Ito 2008), lightened for dark paper.
  const palettes = {
    light: ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#B98300", "#56B4E9", "#444444"],
    dark: ["#5AAEEB", "#FF8F52", "#35CC9C", "#E79FC9", "#F2B933", "#9AD4F7", "#D8D8D8"],
  };
  // Of a satellite by its index, among so many; of what belongs to none by null.
  const colour = (index, count) => {
    const palette = palettes[dark.matches ? "dark" : "light"];
    if (index === null) return style("--ink");
    if (count <= palette.length) return palette[index % palette.length];
    return `hsl(${Math.round((330 * index) / count)}, 65%, ${dark.matches ? 65 : 42}%)`;
  };
  const style = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

  function floats(packed) {
    const text = atob(packed);
    const bytes = new Uint8Array(text.length);
    for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
    return bytes;
  }
  const numbers = (packed) => new Float32Array(floats(packed).buffer);

  async function load() {
    if (typeof DecompressionStream === "undefined") {
      throw new Error("The figures need a browser of 2023 or later; the tables do not.");
    }
    for (const library of document.querySelectorAll("script[id^='library']")) {
      const packed = new Blob([floats(library.textContent)]);
      const text = await new Response(packed.stream().pipeThrough(new DecompressionStream("gzip"))).text();
      const script = document.createElement("script");
      script.textContent = text;
      document.head.append(script);
    }
  }

  const axis = (title) => ({
    title: { text: title, font: { size: 12 } },
    gridcolor: style("--grid"),
    linecolor: style("--rule"),
    zerolinecolor: style("--rule"),
    tickfont: { size: 11 },
    automargin: true,
  });

  const base = () => ({
    paper_bgcolor: "rgba(0,0,0,0)",
    plot_bgcolor: "rgba(0,0,0,0)",
    font: { color: style("--ink"), family: getComputedStyle(document.body).fontFamily },
    modebar: { bgcolor: "rgba(0,0,0,0)", color: style("--soft"), activecolor: style("--accent") },
    hoverlabel: { bgcolor: style("--panel"), bordercolor: style("--rule"), font: { color: style("--ink") } },
  });

  // A frame with heading, room for the figure and note for each chart.
  function addCards(charts, into) {
    for (const chart of charts) {
      const card = document.createElement("div");
      card.className = "figure";
      const heading = document.createElement("h3");
      heading.textContent = chart.title;
      const plot = document.createElement("div");
      plot.className = "plot";
      plot.id = `chart-${chart.key}`;
      card.append(heading, plot);
      if (chart.note) {
        const note = document.createElement("p");
        note.className = "note";
        note.textContent = chart.note;
        card.append(note);
      }
      element(into).append(card);
      chart.plot = plot;
    }
  }

  // Draw, mark the page as drawn, and draw again in other colours; the page says what went wrong.
  function start(draw, afterwards) {
    return load()
      .then(draw)
      .then(() => {
        if (afterwards) afterwards();
        dark.addEventListener("change", draw);
        document.documentElement.dataset.drawn = "yes";
      })
      .catch((error) => {
        element("trouble").hidden = false;
        element("trouble").textContent = error.message;
        throw error;
      });
  }

  return { data, element, dark, config, palettes, colour, style, numbers, axis, base, addCards, start };
})();
