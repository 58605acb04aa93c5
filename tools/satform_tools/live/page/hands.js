// Copyright 2026 satform contributors
// SPDX-License-Identifier: Apache-2.0
"use strict";

// Control of the flight: pause, step, resume, stop, parameters and the graph, by the services of the nodes.
const liveHands = (() => {
  const { element } = page;
  const NICE_SPAN = 10;

  function create({ send, names }) {
    const hands = { send, waiting: new Map(), number: 0, names, sure: false };
    element("hands").hidden = false;
    for (const button of document.querySelectorAll("[data-ask]")) button.onclick = () => ask(hands, { kind: button.dataset.ask });
    element("stop").onclick = () => stop(hands);
    const select = element("gain-satellite");
    select.replaceChildren(...["", ...names].map((name) => new Option(name || "choose", name)));
    select.onchange = () => parameters(hands, select.value);
    return { reply: (answer) => reply(hands, answer), edge: (pair, on) => edge(hands, pair, on), graph: (pairs) => graph(hands, pairs) };
  }

  function ask(hands, request, then) {
    const id = ++hands.number;
    if (then) hands.waiting.set(id, then);
    say("…", true);
    hands.send({ ...request, id });
  }

  function reply(hands, { id, success, text, data }) {
    const then = hands.waiting.get(id);
    hands.waiting.delete(id);
    say(text, success);
    if (then) then({ success, data });
  }

  function say(text, good) {
    element("reply").textContent = text;
    element("reply").className = good ? "" : "bad";
  }

  // A flight that is stopped does not go on: the button asks once more.
  function stop(hands) {
    const button = element("stop");
    if (hands.sure) ask(hands, { kind: "stop" });
    else setTimeout(() => { hands.sure = false; button.textContent = "Stop"; }, 4000);
    hands.sure = !hands.sure;
    button.textContent = hands.sure ? "Stop: sure?" : "Stop";
  }

  function parameters(hands, satellite) {
    element("gain-list").replaceChildren();
    if (!satellite) return;
    ask(hands, { kind: "parameters", satellite }, ({ success, data }) => {
      if (success) element("gain-list").replaceChildren(...data.parameters.map((one) => row(hands, satellite, one)));
    });
  }

  // A slider around the present value within the declared bounds, and a field for any number.
  function row(hands, satellite, { name, value, low, high, description, constraints }) {
    const box = document.createElement("div");
    box.className = "gain";
    const label = document.createElement("label");
    label.textContent = name;
    label.htmlFor = `value-${name}`;
    const slider = document.createElement("input"), field = document.createElement("input"), button = document.createElement("button");
    const alike = Array.isArray(value) && /one number stands for all/.test(constraints) && value.every((number) => number === value[0]);
    if (alike) value = value[0];
    const several = Array.isArray(value);
    field.type = several ? "text" : "number";
    field.step = "any";
    field.id = `value-${name}`;
    field.value = several ? value.map((number) => Number(number.toPrecision(6))).join(", ") : String(value);
    if (!several) range(slider, value, low, high);
    slider.hidden = several;
    slider.setAttribute("aria-label", `${name}, slider`);
    slider.oninput = () => { field.value = String(Number(slider.valueAsNumber.toPrecision(4))); };
    button.type = "button";
    button.textContent = "Set";
    button.onclick = () => {
      const numbers = field.value.split(",").map(Number);
      if (!numbers.every(Number.isFinite) || field.value.trim() === "") say(`${name}: a number, please`, false);
      else ask(hands, { kind: "set", satellite, name, value: numbers });
    };
    const words = document.createElement("small");
    words.textContent = [description, constraints].filter(Boolean).join(" ");
    box.append(label, slider, field, button, words);
    return box;
  }

  function range(slider, value, low, high) {
    const span = Math.abs(value) || 1;
    const from = value < 0 ? value * NICE_SPAN : 0, to = value < 0 ? 0 : span * NICE_SPAN;
    slider.type = "range";
    slider.min = String(Math.max(from, low ?? -Infinity));
    slider.max = String(Math.min(to, high ?? Infinity));
    slider.step = "any";
    slider.value = String(value);
  }

  function edge(hands, [receiver, sender], on) {
    ask(hands, { kind: "edge", receiver, sender, on });
  }

  function graph(hands, pairs) {
    const table = element("edges"), key = pairs.map((pair) => pair.join()).sort().join(";");
    if (table.dataset.key === key || hands.names.length > 16) return;
    table.dataset.key = key;
    const on = new Set(pairs.map((pair) => pair.join()));
    const head = document.createElement("tr");
    head.append(...["", ...hands.names].map((name) => { const cell = document.createElement("th"); cell.textContent = name; return cell; }));
    const rows = hands.names.map((name, receiver) => {
      const line = document.createElement("tr"), first = document.createElement("th");
      first.textContent = name;
      line.append(first, ...hands.names.map((other, sender) => {
        const cell = document.createElement("td"), box = document.createElement("input");
        box.type = "checkbox";
        box.disabled = receiver === sender;
        box.checked = on.has([receiver, sender].join());
        box.setAttribute("aria-label", `${name} receives from ${other}`);
        box.onchange = () => { table.dataset.key = ""; edge(hands, [receiver, sender], box.checked); };
        cell.append(box);
        return cell;
      }));
      return line;
    });
    table.replaceChildren(head, ...rows);
  }

  return { create };
})();
