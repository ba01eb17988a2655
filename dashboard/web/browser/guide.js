// First steps: a card over the scene that follows what is done with the cell. Who closes it finds it
// again behind a small button; the browser remembers that.
"use strict";
(() => {
  const KEY = "lariat-first-steps"; // in the browser's storage: "closed" once it was closed

  const elements = {};
  let steps = [];
  let drawn = "";

  function closed() {
    try {
      return localStorage.getItem(KEY) === "closed";
    } catch {
      return elements.card.dataset.closed === "yes"; // storage is switched off
    }
  }

  function setClosed(value) {
    elements.card.dataset.closed = value ? "yes" : "no";
    try {
      localStorage.setItem(KEY, value ? "closed" : "open");
    } catch {
      // Remembered until the page is loaded anew.
    }
    show();
  }

  function show() {
    if (!elements.card) return;
    const away = steps.length === 0;
    elements.card.hidden = away || closed();
    elements.open.hidden = away || !closed();
    const next = steps.findIndex((step) => !step[1]);
    const text = JSON.stringify(steps);
    if (text === drawn) return;
    drawn = text;
    elements.list.replaceChildren(
      ...steps.map(([title, done, hint], index) => {
        const item = document.createElement("li");
        item.className = done ? "done" : index === next ? "next" : "later";
        item.append(title);
        if (index === next) item.appendChild(document.createElement("p")).textContent = hint;
        return item;
      }),
    );
    const done = steps.filter((step) => step[1]).length;
    elements.heading.textContent = `First steps: ${done} of ${steps.length} done`;
    elements.end.hidden = next !== -1;
  }

  function button(parent, text, name, press) {
    const made = parent.appendChild(document.createElement("button"));
    made.textContent = text;
    made.setAttribute("aria-label", name);
    made.addEventListener("click", () => {
      press();
      made.blur(); // Space holds the arms and must not press it again.
    });
    return made;
  }

  function build() {
    const card = document.createElement("section");
    card.id = "guide";
    card.hidden = true;
    card.setAttribute("aria-label", "First steps");
    elements.heading = card.appendChild(document.createElement("h2"));
    elements.card = card;
    button(card, "×", "Close the first steps", () => setClosed(true));
    elements.list = card.appendChild(document.createElement("ol"));
    elements.end = card.appendChild(document.createElement("p"));
    elements.end.textContent = "That is all. The tabs Scenario, Runs and Events lead on.";
    elements.open = button(document.body, "?", "Show the first steps", () => setClosed(false));
    elements.open.id = "guide-open";
    elements.open.hidden = true;
    document.body.append(card);
    show();
  }

  window.addEventListener("lariat-news", (event) => {
    steps = event.detail.cell.steps ?? [];
    show();
  });
  document.addEventListener("DOMContentLoaded", build);
})();
