// Charts of an enlarged page: their library reads the pointer's place in pixels of the screen and draws
// in those of the page, so that it is told the place in the latter.
"use strict";
(() => {
  function translate(event) {
    const chart = event.target.closest?.(".u-over");
    if (!chart || !event.isTrusted) return;
    const place = chart.getBoundingClientRect();
    const enlargement = place.width / chart.offsetWidth;
    if (Math.abs(enlargement - 1) < 0.01) return;
    event.stopImmediatePropagation();
    const { bubbles, button, buttons, detail, shiftKey, ctrlKey, altKey, metaKey } = event;
    const clientX = place.left + (event.clientX - place.left) / enlargement;
    const clientY = place.top + (event.clientY - place.top) / enlargement;
    const fields = { bubbles, button, buttons, detail, shiftKey, ctrlKey, altKey, metaKey };
    chart.dispatchEvent(new MouseEvent(event.type, { ...fields, cancelable: true, clientX, clientY }));
  }

  for (const type of ["mousedown", "mousemove", "mouseup", "dblclick"]) {
    window.addEventListener(type, translate, true);
  }
})();
